"""Folders that tests read from."""

from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[1]
"""The checkout."""
SHARED: Final = ROOT.parent / "shared"
"""Scenes and recordings that some tests use where they are present."""
