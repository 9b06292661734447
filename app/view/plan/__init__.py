"""The plan: the map from above, with names, as data and as files."""
