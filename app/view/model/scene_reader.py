"""Decodes payloads into the scene model; undecodable ones are counted and skipped."""

from collections import Counter
from collections.abc import Callable
from typing import Final

import msgspec

from app.messages import control, keys, status
from app.messages.body import BodyConfiguration
from app.messages.cdr import MessageError
from app.messages.driving import PaintedRegions
from app.messages.images import decode_camera, decode_color
from app.messages.memory import MapAlignment
from app.messages.motion import decode_path, decode_transforms
from app.messages.recording import RecordingStatus
from app.messages.scene import decode_found_objects, decode_tree, decode_voxels
from app.view.model.scene_model import SceneModel
from app.view.model.seek_history import SEEK_HISTORY, SeekHistory
from app.view.spoken import spoken
from app.view.words import ENGLISH, Words

_JSON_LIMIT: Final = 4 * 2**20


class SceneReader:
    """Updates one `SceneModel` from the network or a recording.

    Args:
        model: The model.
        say: The words in which it gets the navigator's texts.
    """

    def __init__(self, model: SceneModel, say: Words = ENGLISH) -> None:
        self._say = say
        self.rejected: Counter[str] = Counter()
        """Number of undecodable messages by key."""
        self.problem: str | None = None
        """Error of the last undecodable message."""
        self._handlers: dict[str, Callable[[bytes], None]] = {
            keys.STATUS: lambda p: model.on_status(self._json(p, status.Status)),
            keys.LEVELS: lambda p: model.on_proximity(self._json(p, status.LevelTable)),
            keys.PAINTED: lambda p: model.on_painted(self._json(p, PaintedRegions)),
            keys.SEARCHES_SAVED: lambda p: model.on_saved_searches(
                self._json(p, control.SavedSearches)
            ),
            keys.EVENT: lambda p: model.on_event(self._json(p, status.Event)),
            keys.MAP_VOXELS: lambda p: model.on_voxels(decode_voxels(p)),
            keys.MAP_KEYFRAME: lambda p: model.on_keyframe(decode_voxels(p)),
            keys.PLAN_TREE: lambda p: model.on_tree(decode_tree(p)[1]),
            keys.PLAN_PATH: lambda p: model.on_path(decode_path(p)),
            keys.FAR_EVIDENCE: lambda p: model.on_far_evidence(
                self._json(p, status.FarEvidenceCells)
            ),
            keys.DETECTIONS: lambda p: model.on_detections(decode_found_objects(p)[1]),
            keys.MAP_ALIGNMENT: lambda p: model.on_alignment(self._json(p, MapAlignment)),
            keys.CONFIGURATION: lambda p: model.on_configuration(self._json(p, BodyConfiguration)),
            keys.TF: lambda p: model.on_transforms(decode_transforms(p)),
            keys.TF_STATIC: lambda p: model.on_transforms(decode_transforms(p), fixed=True),
            keys.CAMERA_INFO: lambda p: model.on_camera(decode_camera(p)),
            keys.COLOR: lambda p: model.on_image(decode_color(p)),
            keys.RECORDING: lambda p: model.on_recording(self._json(p, RecordingStatus)),
            SEEK_HISTORY: lambda p: model.restore(self._json(p, SeekHistory)),
        }

    @property
    def keys(self) -> tuple[str, ...]:
        """Topics of the scene, without the robot's prefix.

        `SEEK_HISTORY` is excluded, because it is not sent over the network.
        """
        return tuple(key for key in self._handlers if key != SEEK_HISTORY)

    def feed(self, key: str, payload: bytes) -> bool:
        """Decode and apply one message; return whether it could be decoded."""
        handler = self._handlers.get(key)
        if handler is None:
            return False
        try:
            handler(payload)
        except (MessageError, msgspec.DecodeError) as error:
            self.rejected[key] += 1
            self.problem = f"{key}: {error}"
            return False
        return True

    def _json(self, payload: bytes, kind: type[control.M]) -> control.M:
        if len(payload) > _JSON_LIMIT:
            raise MessageError(f"{len(payload)} bytes of JSON came, at most {_JSON_LIMIT} are read")
        return spoken(control.decode(payload, kind), self._say)
