# %% [markdown]
# Map a recorded sequence and draw it: FOLDER holds TUM RGB-D, 7-Scenes, ScanNet, sequence.json,
# an MCAP file or a ROS 2 bag. Cells open as a notebook in VS Code, and with jupytext.
"""Map a recorded sequence, and draw it with viser."""

# %% What to read
import argparse
import sys
from pathlib import Path

import numpy as np
import trimesh
import viser

from app.recognition.frames import open_source
from ippon.mapping.config import MapConfig
from ippon.mapping.mesh import copy_signed_distances, extract_mesh
from ippon.mapping.voxel_map import VoxelMap
from ippon.vocabulary import MATTERPORT_40

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("folder", type=Path, help="folder of the sequence")
parser.add_argument("voxel_size_m", type=float, nargs="?", default=0.05)
arguments = parser.parse_args()
folder, voxel_size_m = arguments.folder, arguments.voxel_size_m

# %% Map every image where it was taken
voxel_map = VoxelMap(MapConfig(voxel_size_m=voxel_size_m), MATTERPORT_40)
path = []
for frame in open_source(folder).frames():
    voxel_map.integrate(frame)
    path.append(frame.T_world_camera[:3, 3])
mesh = extract_mesh(copy_signed_distances(voxel_map))
print(f"{len(path)} images, {len(mesh.faces)} triangles")

# %% Draw the surface, the way of the camera, and the last image where it was taken
server = viser.ViserServer(port=0)
surface = trimesh.Trimesh(mesh.vertices, mesh.faces, vertex_colors=mesh.colors, process=False)
server.scene.add_mesh_trimesh("/surface", surface)
steps = np.stack([path[:-1], path[1:]], axis=1)
server.scene.add_line_segments("/path", steps, np.full((*steps.shape[:2], 3), 220, np.uint8))
look = viser.transforms.SE3.from_matrix(frame.T_world_camera)
server.scene.add_camera_frustum(
    "/camera",
    fov=2.0 * np.arctan2(0.5 * frame.camera.height, frame.camera.fy),
    aspect=frame.camera.width / frame.camera.height,
    scale=0.3,
    image=frame.color,
    wxyz=look.rotation().wxyz,
    position=look.translation(),
)
print(f"http://127.0.0.1:{server.get_port()}")

# %% A script keeps the page open; a notebook does so by itself
if __name__ == "__main__" and not hasattr(sys, "ps1"):
    input("Enter ends. ")
    server.stop()
