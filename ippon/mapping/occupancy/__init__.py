"""Signed distance, occupancy and distance field.

Reading order: `visible_blocks` (blocks in view), `sample_rows` and `ray_endpoints` (voxels that
contain depth points), `geometry_update` with `prefetching`, `free_space` and `block_changes`,
`distance_field`.
"""
