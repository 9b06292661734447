"""Observation models of networks, fitted to recordings with known objects."""
