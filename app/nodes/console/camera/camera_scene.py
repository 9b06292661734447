"""The part of the scene that is drawn over the camera picture."""

from dataclasses import replace
from typing import Final

import numpy as np

from app.view.camera.overlays import CameraScene
from app.view.drawing.find_layer import ObjectMark, marks_of, places_of
from app.view.model.picking import is_hidden
from app.view.model.scene_model import Part, SceneModel
from app.view.words import ENGLISH, Words

CAMERA_PARTS: Final[frozenset[Part]] = frozenset({"camera", "pose", "path", "status", "detections"})
"""Parts of the model that change `camera_scene`."""
_OBJECTS: Final = 8


def camera_scene(model: SceneModel, say: Words = ENGLISH) -> CameraScene:
    """Return a copy of what is drawn over the camera picture, for any thread."""
    status = model.status
    if status is None:
        return CameraScene(camera=model.camera, poses=tuple(model.camera_poses))
    if status.state == "exhausted":
        marks = places_of(model.candidates(), say)
    else:
        marks = marks_of(status.find, model.detections, model.rejected, say)
    # A find that cannot be seen is still where it is; candidates there would only clutter.
    seen = [
        _behind(mark, say) if is_behind else mark
        for mark in marks
        if not (is_behind := _is_hidden(model, mark)) or mark.found
    ]
    return CameraScene(
        camera=model.camera,
        poses=tuple(model.camera_poses),
        T_world_base=model.T_world_base,
        path_world=model.path_world,
        objects=tuple(seen[:_OBJECTS]),
        drive=status.drive,
        wanted="" if status.goal is None else status.goal.object,
        say=say,
    )


def _behind(mark: ObjectMark, say: Words) -> ObjectMark:
    return replace(mark, hidden=True, text=say("camera.hidden", name=mark.text))


def _is_hidden(model: SceneModel, mark: ObjectMark) -> bool:
    """Return whether walls or furniture of the map are before a mark from where the camera is."""
    if model.voxel_size_m is None or not model.camera_poses:
        return False
    _, T_world_camera = model.camera_poses[-1]
    center, size_m = np.array(mark.center_world), np.array(mark.size_m)
    return is_hidden(model.voxels, model.voxel_size_m, T_world_camera[:3, 3], center, size_m)
