from dataclasses import dataclass, field

import pytest


@dataclass
class Told:
    """Keeps what an evaluation tells."""

    stages: list = field(default_factory=list)
    results: list = field(default_factory=list)
    errors: list = field(default_factory=list)
    told: list = field(default_factory=list)

    def begin(self, stage, total):
        self.stages.append((stage, total))

    def advance(self, result=""):
        self.results.append(result)

    def tell(self, text, *, error=False):
        self.told.append(text)
        if error:
            self.errors.append(text)


@pytest.fixture
def observer():
    return Told()
