"""Runs evaluations and stores their rows."""
