"""Probabilities of labels and of the object of interest for surface voxels."""
