"""Probabilities of labels and of the object of interest per surface voxel.

Reading order: `surface_voxels` (storage), `object_layers` (labels, levels, object of interest),
`surface_fusion` (one image), `bayes_update` (posterior of each voxel), `posterior_arithmetic`,
`places` and `place_pooling` (images from one place), `surface_changes` (for views).
"""
