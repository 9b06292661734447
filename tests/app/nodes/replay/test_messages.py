"""Messages of a bag whose file was cut off."""

import logging

import pytest

from app.nodes.replay.messages import bag_messages
from tests.app.recording.conftest import all_messages, write_session


@pytest.mark.parametrize("told", [True, False])
def test_what_is_wrong_with_the_file_is_said_once_and_the_rest_is_read(tmp_path, caplog, told):
    session = write_session(tmp_path)
    path = session.writer.path
    path.write_bytes(path.read_bytes()[:-3000])
    with caplog.at_level(logging.WARNING):
        read = list(bag_messages(path, 0.0, heatmaps=False, told=told))
    assert 0 < len(read) < len(all_messages())
    warned = [text for text in caplog.messages if "the file was not ended" in text]
    assert len(warned) == told
