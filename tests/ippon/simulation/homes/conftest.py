"""Homes that several tests look at; each is made once."""

from functools import cache

import pytest

from ippon.simulation.homes.generator import generate_home


@pytest.fixture(scope="session")
def home():
    return cache(generate_home)
