"""Which coordinate frame hangs on which, when, and what is missing on the way to the camera."""

import copy
import struct
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from itertools import takewhile
from typing import Final

from app.messages import keys
from app.messages.images import decode_camera
from app.messages.keys import BASE_FRAME, ODOMETRY_FRAME, WORLD_FRAME
from app.messages.motion import StampedTransform, decode_odometry, read_transforms
from ippon.frame import NANOSECONDS

IMAGES: Final = (keys.COLOR, keys.COLOR_RAW)
TOPICS: Final = (*IMAGES, keys.CAMERA_INFO, keys.TF, keys.TF_STATIC, keys.ODOM)
"""Topics that tell the frames and their times."""
NO_MOUNT: Final = (
    ". {} says where the base is; --profile FILE with a fixed `tilt` says where the camera is on it"
)
NO_BASE: Final = (
    f"; the base must be called {BASE_FRAME!r}: a fixed transform from the frame that it has to "
    f"{BASE_FRAME!r} belongs into tf_static"
)
MOST_NAMED: Final = 8
MOST_APART_S: Final = 0.05
"""How far an image may be from the first or last pose, see `TransformBuffer`."""
_HEADER: Final = struct.Struct("<iI")


@dataclass(slots=True)
class _Span:
    """First and last stamp."""

    first_ns: int
    last_ns: int

    def add(self, stamp_ns: int) -> None:
        self.first_ns = min(self.first_ns, stamp_ns)
        self.last_ns = max(self.last_ns, stamp_ns)


def image_stamp_ns(payload: bytes) -> int | None:
    """Return the stamp that an Image or CompressedImage begins with; None for another encoding."""
    if len(payload) < 4 + _HEADER.size or payload[1] != 1:
        return None
    seconds, nanoseconds = _HEADER.unpack_from(payload, 4)
    return seconds * NANOSECONDS + nanoseconds


def odometry_child(
    child: str, names: Collection[str], camera: str | None, base: str = BASE_FRAME
) -> str:
    """Return the frame whose pose odometry is: the base, or another that it names.

    Args:
        child: Child frame of its messages.
        names: The frames of tf.
        camera: The camera's frame; None while it is unknown.
        base: Frame of the base.

    Returns:
        The base where the messages name no frame, or one that tf does not know either.
    """
    unknown = child not in names and base not in names and child != camera
    return base if not child or unknown else child


class FrameTree:
    """The frames that a recording names, and when their poses and the images are from.

    Args:
        clock_offset_s: How far the camera's clock is behind that of the poses.
        base: Frame of the base.
    """

    def __init__(self, clock_offset_s: float = 0.0, base: str = BASE_FRAME) -> None:
        self.base = base
        self.by_odometry = False
        """Whether the odometry is one of the transforms, see `completed`."""
        self._offset_ns = round(NANOSECONDS * clock_offset_s)
        self._parents: dict[str, str] = {}
        self._moving: dict[str, _Span] = {}
        self._images: _Span | None = None
        self._camera: str | None = None
        self._odometry: tuple[str, str, _Span] | None = None
        self._has_fixed = False
        self._refused: tuple[str, ...] = ()
        """What is wrong with the first transform that is not rigid."""

    def add(self, key: str, payload: bytes) -> None:
        """Take a message of one of `TOPICS`; others are ignored.

        Raises:
            MessageError: It cannot be decoded.
        """
        if key in IMAGES:
            self._add_image(payload)
        elif key == keys.CAMERA_INFO:
            self._camera = self._camera or decode_camera(payload).frame_id
        elif key == keys.ODOM:
            self._add_odometry(decode_odometry(payload))
        elif key in (keys.TF, keys.TF_STATIC):
            self._has_fixed = self._has_fixed or key == keys.TF_STATIC
            read, refused = read_transforms(payload)
            self._refused = self._refused or refused[:1]
            self.add_transforms(read, fixed=key == keys.TF_STATIC)

    def add_transforms(
        self, transforms: Iterable[StampedTransform], *, fixed: bool = False
    ) -> None:
        """Take the names and times of transforms; the last parent of a frame applies."""
        for transform in transforms:
            self._parents[transform.child] = transform.parent
            if fixed:
                self._moving.pop(transform.child, None)
            else:
                self._move(transform.child, transform.stamp_ns)

    def _move(self, child: str, stamp_ns: int) -> None:
        self._moving.setdefault(child, _Span(stamp_ns, stamp_ns)).add(stamp_ns)

    def _add_image(self, payload: bytes) -> None:
        stamp_ns = image_stamp_ns(payload)
        if stamp_ns is None:
            return
        stamp_ns += self._offset_ns
        if self._images is None:
            self._images = _Span(stamp_ns, stamp_ns)
        self._images.add(stamp_ns)

    def _add_odometry(self, pose: StampedTransform) -> None:
        if self._odometry is None:
            span = _Span(pose.stamp_ns, pose.stamp_ns)
            self._odometry = (pose.parent or ODOMETRY_FRAME, pose.child, span)
        self._odometry[2].add(pose.stamp_ns)

    @property
    def camera(self) -> str:
        """The camera's frame; empty before its first camera info."""
        return self._camera or ""

    @property
    def has_images(self) -> bool:
        """Whether an image was added, so that times are compared."""
        return self._images is not None

    @property
    def odometry_child(self) -> str:
        """Frame whose pose the odometry is: that of its messages, or the base."""
        child = "" if self._odometry is None else self._odometry[1]
        return odometry_child(child, self.names, self._camera, self.base)

    @property
    def lacks_mount(self) -> bool:
        """Whether no transform says where the camera is on the base."""
        return bool(self.camera) and self.camera not in self._parents

    @property
    def mount_hint(self) -> str:
        """That a profile would say where the camera is on the base; empty where it would not."""
        if not self.lacks_mount:
            return ""
        if self._odometry is not None:
            return NO_MOUNT.format("Odometry")
        return "" if self._completed(mount=True).problem() else NO_MOUNT.format("tf")

    @property
    def lacks_base(self) -> bool:
        """Whether the poses are not those of `base_link`, and nobody has named another base."""
        if self.base != BASE_FRAME or not self._parents or self.base in self._parents:
            return False
        return self.world != self.base or self.base not in self.names

    def completed(self, *, mount: bool) -> tuple["FrameTree", str]:
        """Return the tree, with what may be taken for missing transforms where it lacks any.

        Args:
            mount: A profile says where the camera is on the base, where no transform does.

        Returns:
            The tree, this one if it lacks none, and its `problem`.
        """
        tree, problem = self, self.problem()
        for tree in self._completions(mount=mount) if problem else ():
            problem = tree.problem()
            if not problem:
                break
        return tree, problem

    def _completions(self, *, mount: bool) -> list["FrameTree"]:
        """Return the tree with what may be taken for missing transforms, the best first."""
        found = [self._completed(mount=True)] if mount and self.lacks_mount else []
        if self._odometry is not None and self.odometry_child not in self._parents:
            found.append(self._completed(mount=mount, odometry=True))
        return found

    def _completed(self, *, mount: bool, odometry: bool = False) -> "FrameTree":
        tree: FrameTree = copy.copy(self)
        tree._parents, tree._moving = dict(self._parents), dict(self._moving)
        tree._odometry, tree.by_odometry = None, odometry
        if odometry and self._odometry is not None:
            tree._parents[self.odometry_child] = self._odometry[0]
            tree._moving[self.odometry_child] = self._odometry[2]
        if mount and self.camera and self.camera not in tree._parents:
            tree._parents[self.camera] = self.base
        return tree

    @property
    def names(self) -> set[str]:
        """The frames."""
        return {*self._parents, *self._parents.values()}

    @property
    def world(self) -> str:
        """`map`, where it exists; else the root above the base."""
        return WORLD_FRAME if WORLD_FRAME in self.names else self._up(self.base)[-1]

    def problem(self) -> str:
        """Return why no image can have a pose; empty where frames and times lead to the camera."""
        return self._way_problem() or self._time_problem(self.world)

    def are_apart(self) -> bool:
        """Whether the frames lead to the camera, and only the times of images and poses do not."""
        return bool(not self._way_problem() and self._time_problem(self.world))

    def _way_problem(self) -> str:
        world = self.world
        no_base = NO_BASE if self.lacks_base else ""
        if world == self.base:
            return self._told(f"nothing says where {self.base!r} is") + no_base
        for name in (self.base, self._camera):
            if name and world not in self._up(name):
                end = self._up(name)[-1]
                why = f"nothing names {name!r}" if end == name else f"it ends at {end!r}"
                told = self._told(f"no way from {world!r} to {name!r}: {why}")
                return told + (no_base if name == self.base else "")
        return ""

    def _time_problem(self, world: str) -> str:
        """Return how the images and the poses are apart; empty where they are not."""
        images = self._images
        if images is None:
            return ""
        for name, span in self._spans(world):
            early_s = (span.first_ns - images.last_ns) / NANOSECONDS
            late_s = (images.first_ns - span.last_ns) / NANOSECONDS
            if max(early_s, late_s) > MOST_APART_S:
                how = "before the first" if early_s > late_s else "after the last"
                verb = "end" if early_s > late_s else "begin"
                return (
                    f"by their stamps the images {verb} {max(early_s, late_s):.2f} s {how} pose of "
                    f"{name!r}: the clocks of camera and poses differ"
                )
        return ""

    def _spans(self, world: str) -> list[tuple[str, _Span]]:
        """Return the moving frames between the world and base and camera, and their times."""
        ways = (
            takewhile(lambda name: name != world, self._up(end)) for end in (self.base, self.camera)
        )
        names = dict.fromkeys(name for way in ways for name in way)
        return [(name, self._moving[name]) for name in names if name in self._moving]

    def count_unposed(self, image_stamps_ns: Iterable[int]) -> int:
        """Return how many images are from before the first pose or after the last one."""
        spans = [span for _, span in self._spans(self.world)]
        apart_ns = round(MOST_APART_S * NANOSECONDS)
        first_ns = max((span.first_ns for span in spans), default=-(2**63)) - apart_ns
        last_ns = min((span.last_ns for span in spans), default=2**63) + apart_ns
        return sum(not first_ns <= one + self._offset_ns <= last_ns for one in image_stamps_ns)

    def _told(self, text: str) -> str:
        names = sorted(self.names)
        listed = ", ".join(names[:MOST_NAMED]) + (", …" if len(names) > MOST_NAMED else "")
        text += f"; tf has {listed or 'no frame'}" + "".join(f"; {one}" for one in self._refused)
        return text if self._has_fixed else text + ", and there is no tf_static"

    def _up(self, name: str) -> list[str]:
        """Return the frames from one upwards."""
        way = [name]
        while (parent := self._parents.get(way[-1])) is not None and parent not in way:
            way.append(parent)
        return way
