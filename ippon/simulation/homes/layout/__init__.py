"""Rooms, walls and openings of a home."""
