"""Default folder of the sessions."""

from pathlib import Path

import platformdirs


def sessions_folder() -> Path:
    """Return the default folder that sessions are recorded to."""
    return platformdirs.user_data_path("ippon") / "sessions"
