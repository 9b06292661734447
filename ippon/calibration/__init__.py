"""Observation models fitted to recordings in which some objects are known."""
