"""Checks of a live robot: each of its streams, its coordinate frames, its commands."""
