"""Connections to other processes."""
