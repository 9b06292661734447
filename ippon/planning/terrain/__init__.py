"""Terrain: where the body can stand, turn and drive on the floor.

Entry: `traversability.Traversability`, a floor grid that is updated from the map. Reading order:
`body_limits` (footprint and margins), `obstacle_columns` (from voxels to cells), `floor_grid`,
`traversal_record` (driven cells and contacts), `traversability`, `second_chances` (when narrow gaps
are opened), `clearance`, `motion_check`, `reachability`; then `path_geometry`, `unseen_gaps` and
`unseen_shortcut`.
"""
