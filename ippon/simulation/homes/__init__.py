"""Generator of homes from a seed: layout, furniture and small objects."""
