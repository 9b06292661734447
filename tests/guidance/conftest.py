"""What a person would answer, and what GPT-4 answered."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from ippon.guidance.prior import EmbeddedPrior


@pytest.fixture(scope="session")
def prior() -> EmbeddedPrior:
    return EmbeddedPrior()


@pytest.fixture(scope="session")
def expectations() -> dict[str, dict[str, list[str]]]:
    """Levels by object, written before the table was tuned."""
    loaded: Any = yaml.safe_load(
        Path(__file__).with_name("expectations.yaml").read_text(encoding="utf-8")
    )
    return loaded
