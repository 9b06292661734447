"""Rule-based reading of English: words, names of objects, contexts, requests."""
