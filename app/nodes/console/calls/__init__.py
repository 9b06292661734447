"""Calls: what needs a person, and how a person is told."""
