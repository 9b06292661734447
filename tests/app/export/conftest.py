"""The made-up session of the recorder's tests, exported once."""

import json

import pytest

from app.cli.main import run
from tests.app.recording.conftest import write_session


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """Folder with everything that `ippon export` writes of a session whose truth is known."""
    folder = write_session(tmp_path_factory.mktemp("session")).writer.folder
    truth = {"found": True, "correct": True, "spl": 0.71, "soft_spl": 0.8}
    (folder / "result.json").write_text(json.dumps(truth))
    assert run(["export", str(folder)]) == 0
    return folder / "export"
