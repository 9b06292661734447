"""What the tests of pages share."""

import pytest

from tests.chromium import open_browser


@pytest.fixture(scope="module")
def browser():
    """Chromium of the system, else Playwright's own; without one the tests fail."""
    with open_browser() as browser:
        yield browser
