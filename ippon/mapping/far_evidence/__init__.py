"""Evidence for the object from images beyond the range of the map."""
