"""Where the poses of a bag come from: its transforms, or odometry in place of them."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from app.datasets.dataset import DatasetError
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.keys import BASE_FRAME, ODOMETRY_FRAME, WORLD_FRAME
from app.messages.motion import StampedTransform, decode_odometry, encode_transforms
from app.recording.frame_tree import FrameTree
from ippon.geometry import Float64Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BagPoses:
    """What of a bag is its poses."""

    world: str = WORLD_FRAME
    """Frame that is taken as the world; `map` is put there."""
    odometry_child: str = ""
    """Frame whose pose its odometry is; empty where the poses are those of its tf alone."""
    camera_frame: str = ""
    """Frame that the mount of the profile places on `base_link`; empty where tf does."""
    T_base_camera: Float64Array | None = None
    """That mount."""
    base: str = BASE_FRAME
    """Frame of the base; `base_link` is put there."""

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of the poses."""
        return (keys.TF, keys.TF_STATIC, *((keys.ODOM,) if self.odometry_child else ()))

    def note(self, path: Path) -> str:
        """Return what a user should know of them; empty for tf from `map`."""
        notes: list[str] = []
        if self.odometry_child:
            notes.append(f"{path}: the poses are those of its odometry, which drifts")
        if self.camera_frame:
            mount = "where the camera is on the base is taken from the profile"
            notes.append(mount if notes else f"{path}: {mount}")
        if self.world != WORLD_FRAME:
            notes.append(f"{path} has no frame 'map': {self.world!r} is taken as the world")
        return "; ".join(notes)

    def fixed(self) -> bytes | None:
        """Return the transforms that the bag lacks, as a message of tf_static; None for none."""
        links: list[tuple[str, str, Float64Array]] = []
        if self.world != WORLD_FRAME:
            links.append((WORLD_FRAME, self.world, np.eye(4)))
        if self.base != BASE_FRAME:
            links.append((self.base, BASE_FRAME, np.eye(4)))
        if self.camera_frame and self.T_base_camera is not None:
            links.append((BASE_FRAME, self.camera_frame, self.T_base_camera))
        if not links:
            return None
        return encode_transforms(
            StampedTransform(stamp_ns=0, parent=a, child=b, T_parent_child=T) for a, b, T in links
        )

    def converted(self, odometry: bytes) -> bytes:
        """Return a message of odometry as one of tf.

        Raises:
            MessageError: It cannot be decoded.
        """
        pose = decode_odometry(odometry)
        return encode_transforms(
            [
                StampedTransform(
                    stamp_ns=pose.stamp_ns,
                    parent=pose.parent or ODOMETRY_FRAME,
                    child=self.odometry_child,
                    T_parent_child=pose.T_parent_child,
                )
            ]
        )


def poses_of(
    path: Path,
    messages: Iterable[tuple[str, bytes]],
    T_base_camera: Float64Array | None,
    clock_offset_s: float = 0.0,
    base: str = BASE_FRAME,
) -> BagPoses:
    """Return where the poses of a bag come from, after as few of its messages as tell.

    Args:
        path: The bag, for errors.
        messages: Key and payload of the topics of `FrameTree`, in order.
        T_base_camera: Mount of the camera, where a profile says it.
        clock_offset_s: How far the camera's clock is behind that of the poses.
        base: Frame of the base; one that is not `base_link` takes its place.

    Raises:
        DatasetError: No image can have a pose, or a frame `base_link` has another place already;
            says why, and what to do.
    """
    tree = FrameTree(clock_offset_s, base)
    for key, payload in messages:
        try:
            tree.add(key, payload)
        except MessageError:
            continue
        if (
            base == BASE_FRAME
            and tree.has_images
            and tree.camera
            and WORLD_FRAME in tree.names
            and not tree.problem()
        ):
            return BagPoses()
    if base != BASE_FRAME and BASE_FRAME in tree.names:
        raise DatasetError(
            f"{path} has a frame {BASE_FRAME!r} already: {base!r} cannot take its place; leave out "
            "--base-frame"
        )
    mount = T_base_camera is not None
    used, problem = tree.completed(mount=mount)
    if problem:
        raise _no_pose(path, problem + ("" if mount else tree.mount_hint), used)
    mounted = used is not tree and mount and tree.lacks_mount
    return BagPoses(
        world=used.world,
        odometry_child=tree.odometry_child if used.by_odometry else "",
        camera_frame=tree.camera if mounted else "",
        T_base_camera=T_base_camera if mounted else None,
        base=base,
    )


def _no_pose(path: Path, problem: str, tree: FrameTree) -> DatasetError:
    """Return the error of a bag whose images cannot have a pose.

    Args:
        path: The bag.
        problem: Why.
        tree: Its frames.
    """
    what = (
        "with clocks that agree"
        if tree.are_apart()
        else "with tf and tf_static, and with what is missing (static_transform_publisher)"
    )
    if tree.lacks_base:
        what += ", name the frame of the base with --base-frame"
    return DatasetError(
        f"{path}: no image has a pose: {problem}. Record again {what}, or let the poses be found "
        "by the images (`ippon replay --no-poses`, and `ippon navigate --profile hand-held`)"
    )
