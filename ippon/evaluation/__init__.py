"""Metrics and episodes."""
