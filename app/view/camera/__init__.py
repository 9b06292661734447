"""The live camera as operators see it: size and quality, and what is drawn over it."""
