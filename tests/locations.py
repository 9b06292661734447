"""Folders that tests read from."""

from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[1]
"""The checkout."""
SHARED: Final = ROOT.parent / "shared"
"""Scenes and recordings that some tests use where they are present."""
ROS2_PYTHON: Final = ROOT / ".venv-ros2" / "bin" / "python"
"""A Python with a real ROS 2; `scripts/setup --ros2` installs it."""
