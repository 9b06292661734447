"""Recordings of sessions: writing and reading."""
