"""Visibility: what a viewpoint sees, its gain G(n) and its termination T(n).

Entry: `viewpoint_store.ViewpointStore`, the evaluations of all viewpoints. Reading order:
`view_config`, `view_table` (directions and voxel offsets), `rays`, `panorama` (voxels by
direction), `viewpoint_gain` (G(n) and orientation), `view_geometry`, `view_memory` (images of each
voxel), `staleness`, `viewpoint_store`; then `evaluation_scheduler` (order of evaluations) and
`region_weights` (regions of the operator).
"""
