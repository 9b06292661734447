"""Signed distance, occupancy and the distance field."""
