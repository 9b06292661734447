"""Simulated segmentation networks with errors."""
