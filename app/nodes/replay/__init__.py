"""Recorded images as a robot: datasets of others, and bags."""
