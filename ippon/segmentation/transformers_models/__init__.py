"""Segmentation networks of the `transformers` library."""
