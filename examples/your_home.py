# %% [markdown]
# Make a mesh searchable: FOLDER holds scene.glb, whose nodes are named `<category>.<index>`, in
# metres, z up, the floor at 0. The robot starts at X and Y.
"""Write the scene.json of a mesh of your own, then `ippon eval run --homes FOLDER`."""

# %% The mesh
import argparse
import json
from pathlib import Path

import trimesh

from ippon.vocabulary import MATTERPORT_40

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("folder", type=Path, help="folder with scene.glb")
parser.add_argument("x", type=float, help="where the robot starts, metres")
parser.add_argument("y", type=float)
arguments = parser.parse_args()
folder, x_m, y_m = arguments.folder, arguments.x, arguments.y
scene = trimesh.load_scene(folder / "scene.glb")

# %% Each node with its box; what is no category of Matterport is one of its "others"
instances = []
for node in scene.graph.nodes_geometry:
    pose, name = scene.graph[node]
    points = trimesh.transform_points(scene.geometry[name].vertices, pose)
    category = node.rpartition(".")[0]
    instances.append(
        {
            "node": node,
            "category": category if category in MATTERPORT_40 else "others",
            "label": category.replace("_", " "),
            "aabb_min": points.min(axis=0).tolist(),
            "aabb_max": points.max(axis=0).tolist(),
        }
    )

# %% The file
facts = {"name": folder.name, "source": "", "licence": "", "up": "z", "units": "m"}
start = {"x": x_m, "y": y_m, "z": 0.0, "yaw": 0.0}
file = folder / "scene.json"
file.write_text(json.dumps({**facts, "instances": instances, "start_poses": [start]}, indent=1))
print(f"{file}: {len(instances)} things")
