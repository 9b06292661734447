"""Frames that state, or have, more than is accepted are refused before anything is unpacked."""

import pytest
import zstandard

from app.recording.errors import RecordingError
from app.recording.reading.decompression import unpack_zstd
from app.recording.timeline import SessionTimeline, pack_timeline, unpack_timeline

CONTENT = bytes(100_000)


@pytest.mark.parametrize("stated", [True, False])
def test_a_frame_is_unpacked_up_to_the_limit(stated):
    packed = zstandard.ZstdCompressor(write_content_size=stated).compress(CONTENT)
    assert unpack_zstd(packed, len(CONTENT)) == CONTENT
    with pytest.raises(zstandard.ZstdError):
        unpack_zstd(packed, len(CONTENT) - 1)


def test_a_timeline_that_states_a_terabyte_is_refused():
    assert unpack_timeline(pack_timeline(SessionTimeline())) == SessionTimeline()
    # Magic number, descriptor for a size of eight bytes, window, size, and an empty last block.
    bomb = b"\x28\xb5\x2f\xfd" + b"\xc0\x58" + (1 << 40).to_bytes(8, "little") + b"\x01\0\0"
    with pytest.raises(RecordingError, match="it states 1099511627776 bytes"):
        unpack_timeline(bomb)
