"""The voxel map: occupancy, distances to obstacles, and object probabilities of surface voxels.

The entry is `voxel_map.VoxelMap`. Reading order: `config`, `blocks` and `arrays` (the layout),
`integration` (fusing a frame), `occupancy`, `objects`, `far_evidence`, `queries`, `snapshot`,
`map_file`.
"""
