"""What can be seen from a viewpoint, and its gain."""
