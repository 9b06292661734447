"""Decoding of the outputs of each family of detectors."""
