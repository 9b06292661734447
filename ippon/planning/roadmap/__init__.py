"""The graph of verified moves between viewpoints, and local planning."""
