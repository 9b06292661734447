"""Frames that state, or have, more than is accepted are refused before anything is unpacked."""

import pytest
import zstandard

from ippon.decompression import unpack_zstd

CONTENT = bytes(100_000)


@pytest.mark.parametrize("stated", [True, False])
def test_a_frame_is_unpacked_up_to_the_limit(stated):
    packed = zstandard.ZstdCompressor(write_content_size=stated).compress(CONTENT)
    assert unpack_zstd(packed, len(CONTENT)) == CONTENT
    with pytest.raises(zstandard.ZstdError):
        unpack_zstd(packed, len(CONTENT) - 1)
