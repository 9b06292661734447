"""A recording as files for other programs and other people."""
