"""Furnishing of rooms: furniture, small objects, and access for the robot."""
