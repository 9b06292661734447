"""Words of speech: what tells languages apart, and what describes an object."""
