"""Recognises objects in a recording, without a robot: `recognition` is the entry."""
