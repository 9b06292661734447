"""The made-up session of the recorder's tests."""

from tests.app.recording.conftest import made_up, session_folder

__all__ = ["made_up", "session_folder"]
