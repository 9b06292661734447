"""Questions to a language model, and what is read from its answers."""
