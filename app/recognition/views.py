"""Stored data of images, to find those that show an object."""

import zlib
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import Float64Array, invert_transform, transform_points
from ippon.observation import Detections, Instance, Observation
from ippon.segmentation.instance_heatmap import BORDER_SHARE, WELL_SEEN_M

SEEN_SCORE: Final = 0.3
"""Minimum score of an instance for its image to show a find."""
DEPTH_PX: Final = 320
"""Longer side of the stored depth, twice that of a heatmap, so that both read the same pixels."""
_BEHIND_M: Final = 0.3
_NEAREST_M: Final = 0.1


@dataclass(frozen=True, slots=True)
class _PackedMask:
    """A mask in a hundredth of its memory: a detector gives up to 300 an image."""

    shape: tuple[int, ...]
    data: bytes

    @classmethod
    def of(cls, mask: NDArray[np.bool_]) -> "_PackedMask":
        return cls(mask.shape, zlib.compress(np.packbits(mask).tobytes(), level=1))

    def unpacked(self) -> NDArray[np.bool_]:
        bits = np.frombuffer(zlib.decompress(self.data), np.uint8)
        count = int(np.prod(self.shape))
        return np.unpackbits(bits, count=count).reshape(self.shape).astype(np.bool_)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class View:
    """Stored data of an image: 0.3 MB at any size, as recordings have thousands."""

    number: int
    """Index of the frame in its recording, from 0."""
    T_camera_world: Float64Array
    camera: PinholeCamera
    """Camera of the image."""
    depth: NDArray[np.float16]
    """(h, w) depth in metres, every `step`-th pixel of the image."""
    step: int = 1
    detections: Detections | None
    """Instances of the network, without their masks; None for a network without instances."""
    masks: tuple[_PackedMask | None, ...]
    """Mask of each instance."""

    @classmethod
    def of(cls, number: int, frame: Frame, observation: Observation) -> "View":
        """Return the stored data of a frame."""
        step = -(-max(frame.depth.shape) // DEPTH_PX)
        # Whole steps, so that it stays in proportion.
        h, w = (max(1, side // step) for side in frame.depth.shape)
        detections = observation if isinstance(observation, Detections) else None
        instances = () if detections is None else detections.instances
        bare = tuple(replace(one, mask=None) for one in instances)
        return cls(
            number=number,
            T_camera_world=invert_transform(frame.T_world_camera),
            camera=frame.camera,
            depth=frame.depth[::step, ::step][:h, :w].astype(np.float16),
            step=step,
            detections=None if detections is None else replace(detections, instances=bare),
            masks=tuple(
                None if one.mask is None else _PackedMask.of(one.mask) for one in instances
            ),
        )

    def with_masks(self) -> Detections | None:
        """Return the instances of the network with their masks."""
        if self.detections is None:
            return None
        instances = tuple(
            one if mask is None else replace(one, mask=mask.unpacked())
            for one, mask in zip(self.detections.instances, self.masks, strict=True)
        )
        return replace(self.detections, instances=instances)

    def depth_at(self, u: float, v: float) -> float:
        """Return the depth in metres about a pixel of the image, 0 for no return."""
        h, w = self.depth.shape
        return float(self.depth[min(int(v) // self.step, h - 1), min(int(u) // self.step, w - 1)])

    def pixel_of(
        self, point_world: tuple[float, float, float]
    ) -> tuple[float, float, float] | None:
        """Return (u, v, metres) of a point; None if it is out of view or occluded."""
        point = transform_points(self.T_camera_world, np.array([point_world]))
        z = float(point[0, 2])
        if z < _NEAREST_M:
            return None
        u, v = (float(x[0]) for x in self.camera.project(point))
        if not (0 <= u < self.camera.width and 0 <= v < self.camera.height):
            return None
        depth = self.depth_at(u, v)
        if depth > 0.0 and depth < z - _BEHIND_M:
            return None
        return u, v, z

    def instance_at(self, label: str, u: float, v: float) -> Instance | None:
        """Return the best instance of a label whose box contains a pixel."""
        instances = () if self.detections is None else self.detections.instances
        here = [
            one
            for one in instances
            if one.label == label
            and one.box_px[0] <= u <= one.box_px[2]
            and one.box_px[1] <= v <= one.box_px[3]
        ]
        return max(here, key=lambda one: one.score, default=None)

    def shows(self, label: str, point_world: tuple[float, float, float]) -> bool | None:
        """Return whether an instance of a label with at least `SEEN_SCORE` is at a point.

        Returns:
            None where there is none, and the point is out of view, covered, too far away or too
            near the border of the image for the network to be expected to recognise it.
        """
        at = self.pixel_of(point_world)
        if at is None or self.detections is None or label not in self.detections.labels:
            return None
        u, v, distance_m = at
        one = self.instance_at(label, u, v)
        if one is not None and one.score >= SEEN_SCORE:
            return True
        margin = BORDER_SHARE * max(self.camera.width, self.camera.height)
        is_inside = margin <= u < self.camera.width - margin
        is_inside &= margin <= v < self.camera.height - margin
        return False if is_inside and distance_m <= WELL_SEEN_M else None
