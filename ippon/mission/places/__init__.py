"""Places of a search that are known: where the object was seen, and rooms that were said."""
