"""The voxel map: geometry, object probabilities and distances to obstacles."""
