"""Finds: clusters of voxels that may be the object, and the checks before a search ends."""
