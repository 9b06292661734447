"""The voxel map: occupancy, distance to obstacles, and object probabilities of surface voxels.

The entry is `voxel_map.VoxelMap`. Reading order: `config`, `blocks` and `arrays` (the layout),
`integration` (one frame), `frame_blocks`, `occupancy`, `objects`, `far_evidence`, `queries`,
`snapshot`, `map_file`.
"""
