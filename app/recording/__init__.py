"""Sessions written to disk and read again."""
