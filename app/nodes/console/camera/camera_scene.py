"""The part of the scene that is drawn over the camera picture."""

from typing import Final

from app.view.camera.overlays import CameraScene, OutlinedObject
from app.view.drawing.find_layer import marks_of, places_of
from app.view.model.scene_model import Part, SceneModel

CAMERA_PARTS: Final[frozenset[Part]] = frozenset({"camera", "pose", "path", "status", "detections"})
"""Parts of the model that change `camera_scene`."""
_OBJECTS: Final = 8


def camera_scene(model: SceneModel) -> CameraScene:
    """Return a copy of what is drawn over the camera picture, for any thread."""
    status = model.status
    if status is None:
        return CameraScene(camera=model.camera, poses=tuple(model.camera_poses))
    if status.state == "exhausted":
        marks = places_of(model.candidates())
    else:
        marks = marks_of(status.find, model.detections, model.rejected)
    objects = tuple(
        OutlinedObject(
            center_world=mark.center_world,
            size_m=mark.size_m,
            text=mark.text,
            found=mark.found,
        )
        for mark in marks[:_OBJECTS]
    )
    return CameraScene(
        camera=model.camera,
        poses=tuple(model.camera_poses),
        T_world_base=model.T_world_base,
        path_world=model.path_world,
        objects=objects,
        drive=status.drive,
        wanted="" if status.goal is None else status.goal.object,
    )
