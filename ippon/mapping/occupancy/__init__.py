"""Signed distance, occupancy and distance field.

Reading order: `visible_blocks` (blocks in view), `sample_rows` and `ray_endpoints` (voxels that
contain depth points), `geometry_update`, `free_space`, `distance_field`.
"""
