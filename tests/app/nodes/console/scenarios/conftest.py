"""What the tests of pages share."""

import pytest

from tests.chromium import each_stop_once, open_browser


@pytest.fixture(scope="module")
def browser():
    """Chromium of the system, else Playwright's own; without one the tests fail."""
    with open_browser() as browser:
        yield browser


@pytest.fixture(name="each_stop_once")
def counted_stops(page):
    """See `each_stop_once`, for the page of the test."""
    with each_stop_once(page):
        yield
