"""Where sessions are kept."""

from pathlib import Path

import platformdirs


def sessions_folder() -> Path:
    """Return the folder that sessions are recorded to where nobody names another."""
    return platformdirs.user_data_path("ippon") / "sessions"
