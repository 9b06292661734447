"""Homes generated from a seed: layout, furniture and the small things people leave about."""
