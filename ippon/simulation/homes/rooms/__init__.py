"""Furnishing rooms: which pieces stand where."""
