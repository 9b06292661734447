"""Which coordinate frame hangs on which, and what is missing on the way to the camera."""

from collections.abc import Iterable
from typing import Final

from app.messages import keys
from app.messages.images import decode_camera
from app.messages.motion import StampedTransform, decode_transforms

WORLD: Final = "map"
BASE: Final = "base_link"
TOPICS: Final = (keys.CAMERA_INFO, keys.TF, keys.TF_STATIC)
"""Topics that tell the frames."""
MOST_NAMED: Final = 8


class FrameTree:
    """The frames that a recording names."""

    def __init__(self) -> None:
        self._parents: dict[str, str] = {}
        self._camera: str | None = None
        self._has_fixed = False

    def add(self, key: str, payload: bytes) -> None:
        """Take a message of one of `TOPICS`; others are ignored.

        Raises:
            MessageError: It cannot be decoded.
        """
        if key == keys.CAMERA_INFO:
            self._camera = self._camera or decode_camera(payload).frame_id
        elif key in (keys.TF, keys.TF_STATIC):
            self._has_fixed = self._has_fixed or key == keys.TF_STATIC
            self.add_transforms(decode_transforms(payload))

    def add_transforms(self, transforms: Iterable[StampedTransform]) -> None:
        """Take the names of transforms; the last parent of a frame applies."""
        for transform in transforms:
            self._parents[transform.child] = transform.parent

    @property
    def names(self) -> set[str]:
        """The frames."""
        return {*self._parents, *self._parents.values()}

    @property
    def world(self) -> str:
        """`map`, where it exists; else the root above `base_link`."""
        return WORLD if WORLD in self.names else self._up(BASE)[-1]

    def problem(self) -> str:
        """Return why no image can have a pose; empty where the frames lead to the camera."""
        world = self.world
        if world == BASE:
            return self._told(f"nothing says where {BASE!r} is")
        for name in (BASE, self._camera):
            if name and world not in self._up(name):
                end = self._up(name)[-1]
                why = f"nothing names {name!r}" if end == name else f"it ends at {end!r}"
                return self._told(f"no way from {world!r} to {name!r}: {why}")
        return ""

    def _told(self, text: str) -> str:
        names = sorted(self.names)
        listed = ", ".join(names[:MOST_NAMED]) + (", …" if len(names) > MOST_NAMED else "")
        text += f"; tf has {listed or 'no frame'}"
        return text if self._has_fixed else text + ", and there is no tf_static"

    def _up(self, name: str) -> list[str]:
        """Return the frames from one upwards."""
        way = [name]
        while (parent := self._parents.get(way[-1])) is not None and parent not in way:
            way.append(parent)
        return way
