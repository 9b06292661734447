"""habitat-lab without habitat-sim, and our homes and starts in its format."""

import gzip
import json
import math
import sys
import types
import warnings

import numpy as np


def import_habitat():
    """Import habitat-lab without habitat-sim, which no package index has.

    Four modules of it need the simulator at import and nothing here needs them.
    """

    def stub(name, **attributes):
        if name not in sys.modules:
            module = types.ModuleType(name)
            module.__dict__.update(attributes)
            sys.modules[name] = module

    stub(
        "habitat.sims.habitat_simulator.object_state_machine",
        ObjectStateMachine=type("ObjectStateMachine", (), {}),
    )
    stub("habitat.tasks.rearrange", _try_register_rearrange_task=lambda: None)
    stub("habitat.datasets.rearrange", _try_register_rearrangedatasetv0=lambda: None)
    stub("habitat.core.vector_env", VectorEnv=None, ThreadedVectorEnv=None)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        import habitat
    return habitat


def to_habitat(point):
    """Our x, y (z up) as theirs (y up), float64: float32 would move cells of the floor."""
    return np.array([point[0], 0.0, -point[1]], dtype=np.float64)


def to_rotation(yaw):
    """Our yaw as the (x, y, z, w) of theirs: forward is -z, left turns go round y."""
    half = 0.5 * (yaw - math.pi / 2.0)
    return [0.0, math.sin(half), 0.0, math.cos(half)]


def write_dataset(path, runs, names):
    """Write (episode, judge) pairs in the format of Habitat's ObjectNav data."""
    categories = {goal: k for k, goal in enumerate(names)}
    goals, episodes = {}, []
    for k, (episode, judge) in enumerate(runs):
        views = [
            {
                "agent_state": {
                    "position": to_habitat(p).tolist(),
                    "rotation": [0.0, 0.0, 0.0, 1.0],
                },
                "iou": 1.0,
            }
            for p in judge.viewpoints
        ]
        scene = f"home{k}.glb"
        goals[f"{scene}_{episode.goal}"] = [
            {
                "object_id": "0",
                "object_category": episode.goal,
                "position": views[0]["agent_state"]["position"],
                "view_points": views,
            }
        ]
        start = (episode.start.x, episode.start.y)
        episodes.append(
            {
                "episode_id": str(k),
                "scene_id": scene,
                "start_position": to_habitat(start).tolist(),
                "start_rotation": to_rotation(episode.start.yaw),
                "object_category": episode.goal,
                "goals": [],
                "info": {},
            }
        )
    content = {
        "episodes": episodes,
        "goals_by_category": goals,
        "category_to_task_category_id": categories,
        "category_to_scene_annotation_category_id": categories,
    }
    with gzip.open(path, "wt", encoding="utf-8") as file:
        json.dump(content, file)
