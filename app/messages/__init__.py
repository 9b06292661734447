"""Messages between processes: their types, keys and encodings."""
