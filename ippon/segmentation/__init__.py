"""Label probabilities per pixel."""
