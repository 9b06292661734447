"""Words and phrases of a sentence: nouns, what stands before them, and places."""
