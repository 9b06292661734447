"""English sentences: words, names of objects, contexts."""
