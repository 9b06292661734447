"""The browser that drives the page: `python tests/browser.py` prints it, or ends with status 1.

The standard library alone, because `scripts/setup` asks before Playwright has a browser.
"""

import shutil
import subprocess
import sys
from pathlib import Path

NAMES = (
    "chromium-headless-shell",
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
)
"""The best first: without a GPU the headless shell draws for a quarter of the processor time."""
PATIENCE_S = 30.0


def find_browser() -> str | None:
    """Return the system's Chromium if it runs, else Playwright's own, else None."""
    path = system_browser() or _playwrights_own()
    return path if path is not None and runs(path) else None


def system_browser() -> str | None:
    """Return the system's Chromium if it runs, else None."""
    for name in NAMES:
        path = shutil.which(name)
        if path is not None and runs(path):
            return path
    return None


def runs(path: str) -> bool:
    """Tell whether a browser starts: Ubuntu's package is a stub that asks for a snap."""
    try:
        done = subprocess.run(
            [path, "--version"], capture_output=True, timeout=PATIENCE_S, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return done.returncode == 0


def _playwrights_own() -> str | None:
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        return None
    with sync_playwright() as playwright:
        path = playwright.chromium.executable_path
    return path if Path(path).exists() else None


if __name__ == "__main__":
    found = find_browser()
    if found is None:
        sys.exit(1)
    sys.stdout.write(f"{found}\n")
