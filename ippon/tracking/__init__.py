"""Poses of a camera that knows none, from its images alone."""
