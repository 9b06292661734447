"""Decompression of zstd with a limit that a damaged or hostile file cannot exceed."""

import zstandard


def unpack_zstd(packed: bytes, most_bytes: int) -> bytes:
    """Return the content of a zstd frame.

    Args:
        packed: The frame.
        most_bytes: Largest content that is accepted.

    Raises:
        zstandard.ZstdError: It is damaged, or its content is larger.
    """
    # The limit of the library does not apply to a frame that states its own size.
    stated = zstandard.frame_content_size(packed)
    if stated > most_bytes:
        raise zstandard.ZstdError(f"it states {stated} bytes; it holds {most_bytes} at most")
    return zstandard.ZstdDecompressor().decompress(packed, max_output_size=most_bytes)
