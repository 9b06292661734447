"""Simulated homes, cameras and robots."""
