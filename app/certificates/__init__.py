"""Certificates and zenoh profiles for a robot's processes."""
