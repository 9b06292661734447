"""Several objects of interest at once: the evidence for each, beside the map's common objects."""
