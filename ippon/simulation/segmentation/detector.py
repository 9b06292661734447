"""A simulated detector: instances with scores, with the measured errors of a real one."""

import operator
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.geometry import Float64Array, invert_transform, transform_points
from ippon.observation import Detections
from ippon.segmentation.instances import make_detections
from ippon.simulation.camera.renderer import Rendering
from ippon.simulation.scene import Scene
from ippon.simulation.segmentation.false_places import FalsePlaceConfig, draw_false_places
from ippon.simulation.segmentation.heatmap import sigmoid
from ippon.simulation.segmentation.instance_boxes import InstanceBoxes, instance_boxes
from ippon.simulation.segmentation.truth import NamePredicate, detectable_labels, true_label
from ippon.simulation.segmentation.view_noise import UInt64Array, hashed, normals, view_noise

SOURCE: Final = "simulated detector"
"""Its name, the key of its observation model."""
IMAGE_PX: Final = 640
"""Sizes in pixels refer to an image with this longer side."""
_NEAREST_M: Final = 0.3
_ON_SURFACE_M: Final = 0.1
"""Depth difference below which a place is visible at its pixel."""
_RIGHT, _THING, _VIEW, _FRAME, _LABEL = range(1, 6)


@dataclass(frozen=True, slots=True, kw_only=True)
class ScoreConfig:
    """Distribution of the scores of one kind of box, in logits, before the loss by small size."""

    mean: float
    """Mean; larger gives higher scores."""
    label_sigma: float
    """Differences between labels; larger makes labels more unequal."""
    thing_sigma: float
    """Differences between objects or places, constant over views; larger makes more persistent
    errors."""
    view_sigma: float
    """Differences between views of one object, shared by similar views; larger makes errors depend
    on the view."""
    frame_sigma: float
    """Differences between images from one place; larger makes errors flicker."""

    def __post_init__(self) -> None:
        """Reject values out of range."""
        sigmas = (self.label_sigma, self.thing_sigma, self.view_sigma, self.frame_sigma)
        if not np.isfinite(self.mean) or not all(0.0 <= x <= 100.0 for x in sigmas):
            raise ValueError(
                f"the mean is finite, sigmas lie in 0 to 100; got {self.mean}, {sigmas}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorConfig:
    """Quality of the simulated detector.

    The defaults are fitted to NanoDet-Plus on a real kitchen (`scripts/benchmark detector`).
    """

    right: ScoreConfig = field(
        default_factory=lambda: ScoreConfig(
            mean=0.2, label_sigma=0.0, thing_sigma=0.5, view_sigma=0.3, frame_sigma=0.25
        )
    )
    """Scores of true detections."""
    wrong: ScoreConfig = field(
        default_factory=lambda: ScoreConfig(
            mean=-2.8, label_sigma=0.35, thing_sigma=0.42, view_sigma=0.42, frame_sigma=0.3
        )
    )
    """Scores at places of false detections."""
    places: FalsePlaceConfig = field(default_factory=FalsePlaceConfig)
    """Places of false detections."""
    smallest_px: float = 80.0
    """Side of the box at which an object of 1 m loses one logit, at half of it four; for other
    sizes it scales with the root of the size. Larger misses more distant objects."""
    least_score: float = 0.15
    """Least score of a box; less returns hundreds of boxes per image, nearly all false, and costs
    time."""

    def __post_init__(self) -> None:
        """Reject values out of range."""
        if not 0.0 <= self.smallest_px <= IMAGE_PX or not 0.0 < self.least_score < 1.0:
            raise ValueError(
                f"smallest_px lies in 0 to {IMAGE_PX} and least_score in (0, 1); got "
                f"{self.smallest_px}, {self.least_score}"
            )


class SimulatedDetector:
    """Detects the objects of one scene, with false detections at some places.

    Each object and each such place has a score that depends on the view, so that misses and false
    detections persist in similar views. An image depends only on the seed, the labels, the pose and
    its index; a change of labels keeps the errors of the others.
    """

    def __init__(
        self,
        scene: Scene,
        labels: Sequence[str],
        ooi: str | None,
        config: DetectorConfig | None = None,
        seed: int = 0,
        is_instance_of: NamePredicate = operator.eq,
        *,
        also: Sequence[str] = (),
    ) -> None:
        """Draw the persistent errors.

        Args:
            scene: The home.
            labels: Common labels, canonical and distinct.
            ooi: Canonical label of the object of interest, None for none.
            config: Quality.
            seed: Seed of all errors.
            is_instance_of: See `true_label`.
            also: Further objects of interest.
        """
        self.labels, self.ooi, self.also = tuple(labels), ooi, tuple(also)
        if len(set(self.labels)) != len(self.labels):
            raise ValueError(f"labels must be distinct; got {self.labels}")
        self.config = config or DetectorConfig()
        self._told = detectable_labels(self.labels, ooi, self.also)
        row_of = {label: k for k, label in enumerate(self._told)}
        truths = [
            true_label(i, self.labels, ooi, is_instance_of, self.also) for i in scene.instances
        ]
        self._truth = np.array([row_of.get(x or "", -1) for x in truths], np.int64)
        is_label = self._truth[:, None] == np.arange(len(self._told))
        self._places = draw_false_places(scene, self._told, is_label, self.config.places, seed)
        numbers = np.arange(len(scene.instances), dtype=np.uint64)
        self._keys = hashed(numbers, seed, _RIGHT)
        self._centres = np.array(
            [np.add(i.aabb_min, i.aabb_max) * 0.5 for i in scene.instances], np.float64
        ).reshape(-1, 3)
        self._right = self._lasting(self.config.right, self._keys)
        self._wrong = self._lasting(self.config.wrong, self._places.keys)
        # Keyed by name, so that a label keeps its errors when other labels change.
        names = np.array([crc32(label.encode()) for label in self._told], np.uint64)
        by_label = self.config.wrong.label_sigma * normals(hashed(names, seed, _LABEL))
        self._wrong += by_label[self._places.label]
        by_label = self.config.right.label_sigma * normals(hashed(names, seed, _LABEL, _RIGHT))
        known = np.flatnonzero(self._truth >= 0)
        self._right[known] += by_label[self._truth[known]]

    def detect(
        self,
        rendering: Rendering,
        camera: PinholeCamera,
        T_world_camera: Float64Array,
        frame_index: int,
    ) -> Detections:
        """Return the instances in one image.

        Args:
            rendering: Noise-free images.
            camera: Camera of the image.
            T_world_camera: (4, 4) pose of the camera.
            frame_index: Number of the frame, from 0.

        Returns:
            Boxes without masks, best scores first.
        """
        seen = instance_boxes(rendering.instance, rendering.depth, len(self._truth))
        right = self._right_boxes(seen, camera, T_world_camera, frame_index)
        wrong = self._wrong_boxes(rendering, seen.instance, camera, T_world_camera, frame_index)
        boxes = np.concatenate([right[0], wrong[0]])
        scores = np.concatenate([right[1], wrong[1]])
        rows = np.concatenate([right[2], wrong[2]])
        keep = np.flatnonzero(scores >= self.config.least_score)
        return make_detections(
            boxes[keep],
            scores[keep],
            [self._told[k] for k in rows[keep]],
            source=SOURCE,
            labels=self._told,
            ooi=self.ooi,
            image_size=(camera.height, camera.width),
        )

    def _right_boxes(
        self,
        seen: InstanceBoxes,
        camera: PinholeCamera,
        T_world_camera: Float64Array,
        frame_index: int,
    ) -> tuple[Float64Array, Float64Array, NDArray[np.int64]]:
        """Return boxes, scores and labels of true detections."""
        known = np.flatnonzero(self._truth[seen.instance] >= 0)
        k, box = seen.instance[known], seen.box_px[known]
        side = np.sqrt((box[:, 2] - box[:, 0]) * (box[:, 3] - box[:, 1]))
        size_m = side * seen.range_m[known] / camera.fx
        offsets = T_world_camera[:3, 3] - self._centres[k]
        logit = self._right[k] - self._loss(side, size_m, camera)
        logit += _noise(self.config.right, self._keys[k], offsets, frame_index)
        return box, sigmoid(logit), self._truth[k]

    def _wrong_boxes(
        self,
        rendering: Rendering,
        instances: NDArray[np.int64],
        camera: PinholeCamera,
        T_world_camera: Float64Array,
        frame_index: int,
    ) -> tuple[Float64Array, Float64Array, NDArray[np.int64]]:
        """Return boxes, scores and labels of false detections."""
        places = self._places
        in_view = np.zeros(len(self._truth), np.bool_)
        in_view[instances] = True
        at = np.flatnonzero(in_view[places.instance])
        points = transform_points(invert_transform(T_world_camera), places.points[at])
        ahead = points[:, 2] > _NEAREST_M
        at, points = at[ahead], points[ahead]
        u, v = camera.project(points)
        inside = (u >= 0.0) & (u < camera.width) & (v >= 0.0) & (v < camera.height)
        at, u, v, z = at[inside], u[inside], v[inside], points[inside, 2]
        pixel = v.astype(np.int64), u.astype(np.int64)
        shown = rendering.instance[pixel] == places.instance[at]
        shown &= np.abs(rendering.depth[pixel] - z) < _ON_SURFACE_M
        at, u, v, z = at[shown], u[shown], v[shown], z[shown]
        side = camera.fx * places.size_m[at] / z
        offsets = T_world_camera[:3, 3] - places.points[at]
        logit = self._wrong[at] - self._loss(side, places.size_m[at], camera)
        logit += _noise(self.config.wrong, places.keys[at], offsets, frame_index)
        half = 0.5 * side
        box = np.stack([u - half, v - half, u + half, v + half], axis=1)
        return box, sigmoid(logit), places.label[at]

    def _loss(
        self, side_px: Float64Array, size_m: Float64Array, camera: PinholeCamera
    ) -> Float64Array:
        """Return the loss by small size in logits: the square of a side over that of the box."""
        side = side_px * (IMAGE_PX / max(camera.width, camera.height))
        return size_m * np.square(self.config.smallest_px / side)

    def _lasting(self, scores: ScoreConfig, keys: UInt64Array) -> Float64Array:
        return scores.mean + scores.thing_sigma * normals(hashed(keys, _THING))


def _noise(
    scores: ScoreConfig, keys: UInt64Array, offsets_m: Float64Array, frame_index: int
) -> Float64Array:
    """Return the noise of view and frame, in logits."""
    by_view = view_noise(hashed(keys, _VIEW), offsets_m)
    by_frame = normals(hashed(keys, _FRAME, frame_index))
    return scores.view_sigma * by_view + scores.frame_sigma * by_frame
