"""What a person would answer, and what GPT-4 answered."""

from pathlib import Path
from typing import Any

import pytest
import yaml

from ippon.guidance.prior import EmbeddedPrior


@pytest.fixture(scope="session")
def prior() -> EmbeddedPrior:
    return EmbeddedPrior()


Answers = dict[str, dict[str, list[str]]]


@pytest.fixture(scope="session")
def expectations() -> dict[str, Answers]:
    """Levels by object: `expectations` from before the table was tuned, the others unseen by it."""
    here = Path(__file__).parent
    loaded: dict[str, Any] = {
        path.stem: yaml.safe_load(path.read_text(encoding="utf-8"))
        for path in sorted(here.glob("expectations*.yaml"))
    }
    return loaded
