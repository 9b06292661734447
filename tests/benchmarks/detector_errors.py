"""Errors of a real detector on real images, beside those of the simulated one.

The images are a hand-held Kinect's in a kitchen in which some objects are known, and some kinds of
thing are known to be absent (`objects.json`). A known object is in view where its centre projects
inside the image and nothing is before it. A box is wrong where its kind is absent, or where no
known object of its kind is near and all of that kind are known.
"""

import functools
import itertools
import json
import sys
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ippon.camera import PinholeCamera
from ippon.geometry import invert_transform, transform_points
from tests.benchmarks.rows import Row
from tests.locations import SHARED

KITCHEN: Final = SHARED / "rgbd" / "redkitchen_a"
MODEL: Final = SHARED / "models" / "nanodet_plus_m_416" / "nanodet-plus-m_416.param"
SCORES: Final = (0.15, 0.2, 0.3, 0.4, 0.5)
SIZES_PX: Final = (8, 16, 24, 32, 48, 64, 96, 128, 192, 640)
RANGES_M: Final = (1.0, 1.25, 1.5, 1.75, 2.6)
SHRUNK: Final = (1, 1.5, 2, 3, 4, 6)
"""Images are shown smaller as well: things of fewer pixels, as from farther away."""
WRONG_FROM: Final = 0.15
FEW_KINDS: Final = 12
"""Up to so many kinds each has a row of its own."""
SAME_M: Final = 0.25
"""Wrong boxes of one label are at one place within this distance."""
SAME_SHARE: Final = 0.4
"""Boxes in images shown at different sizes are the same from this overlap on."""
NEAR_M: Final = {"cup": 0.3, "tv": 0.9, "chair": 0.5, "book": 0.5, "table": 1.2}
"""How far the middle of a right box's surface may be from its object's centre."""
DRAWN: Final = 2_000_000
BOUND_LABELS: Final = ("bed", "sofa", "toilet", "chair", "tv")
_FLAT: Final = 0.9
_UPRIGHT: Final = 0.25


@dataclass(frozen=True)
class Box:
    """A detection, and where in the world the middle of its surface is."""

    label: str
    score: float
    box_px: tuple[float, float, float, float]
    at_world: NDArray[np.float64] | None
    range_m: float

    @property
    def side_px(self) -> float:
        """Side of the square of the same area."""
        left, top, right, bottom = self.box_px
        return float(np.sqrt((right - left) * (bottom - top)))


@dataclass(frozen=True)
class View:
    """An image and what was found in it."""

    camera: PinholeCamera
    T_world_camera: NDArray[np.float64]
    depth: NDArray[np.float32]
    color: NDArray[np.uint8]
    boxes: tuple[Box, ...]

    def pixel(
        self, point: NDArray[np.float64], size_m: float = 0.0
    ) -> tuple[float, float, float] | None:
        """Return u, v and depth of a thing's centre; None outside the image or behind another."""
        at = transform_points(invert_transform(self.T_world_camera), point[None])
        if at[0, 2] < 0.3:
            return None
        u, v = (float(x[0]) for x in self.camera.project(at))
        if not (0 <= u < self.camera.width and 0 <= v < self.camera.height):
            return None
        depth = float(self.depth[int(v), int(u)])
        if depth <= 0.0 or depth < at[0, 2] - max(SAME_M, 0.7 * size_m):
            return None
        return u, v, float(at[0, 2])


def boxes_of(found: Any, view: View) -> tuple[Box, ...]:
    """Return an image's detections with their places."""
    out: list[Box] = []
    for one in found.instances:
        left, top, right, bottom = one.box_px
        w, h = right - left, bottom - top
        rows = slice(int(top + h / 4), int(bottom - h / 4) + 1)
        middle = view.depth[rows, int(left + w / 4) : int(right - w / 4) + 1]
        known = middle[middle > 0.0]
        at, z = None, 0.0
        if known.size >= 4:
            z = float(np.median(known))
            u, v = 0.5 * (left + right), 0.5 * (top + bottom)
            c = view.camera
            point = np.array([[(u - c.cx) / c.fx * z, (v - c.cy) / c.fy * z, z]])
            at = transform_points(view.T_world_camera, point)[0]
        out.append(Box(one.label, one.score, one.box_px, at, z))
    return tuple(out)


class Kitchen:
    """The images, the detector and the truth."""

    def __init__(self) -> None:
        from app.recognition.frames import open_source
        from ippon.segmentation.config import SegmentationConfig
        from ippon.segmentation.detectors.detector import Detector

        config = SegmentationConfig(backend="detector", model=str(MODEL), threads=1)
        self._detector = Detector(config, SHARED)
        truth = json.loads((KITCHEN / "objects.json").read_text("utf-8"))
        vocabulary = self._detector.vocabulary
        ours = {"dining_table": "table", "couch": "sofa"}
        self._asked = tuple(ours.get(name, name) for name in vocabulary.classes)
        source = open_source(KITCHEN)
        self.objects = [
            (o["label"], _moved(source.T_map_world, o["centre_world"]), o["about_m"])
            for o in truth["objects"]
        ]
        self._unclear = [_moved(source.T_map_world, o["centre_world"]) for o in truth["unclear"]]
        self.wrong_kinds = (*truth["complete_for"], *truth["absent"])
        self.views: list[View] = []
        for frame in source.frames():
            depth = np.nan_to_num(frame.depth)
            view = View(frame.camera, frame.T_world_camera, depth, frame.color, ())
            self.views.append(replace(view, boxes=self.detect(view, 1.0)))

    def detect(self, view: View, smaller: float) -> tuple[Box, ...]:
        """Detect in an image that fills a part of the frame; boxes are in its own pixels."""
        h, w = view.color.shape[:2]
        size = round(w / smaller), round(h / smaller)
        canvas = np.full_like(view.color, 114)
        x, y = (w - size[0]) // 2, (h - size[1]) // 2
        image = Image.fromarray(view.color).resize(size, Image.Resampling.BOX)
        canvas[y : y + size[1], x : x + size[0]] = image
        found = self._detector.segment(canvas, self._asked, None)
        moved = [
            replace(i, box_px=tuple(smaller * (p - o) for p, o in zip(i.box_px, (x, y) * 2)))  # noqa: B905
            for i in found.instances
        ]
        return boxes_of(replace(found, instances=tuple(moved)), view)

    def is_wrong(self, box: Box) -> bool:
        """Tell whether a box of a kind whose things are all known is none of them."""
        if box.label not in self.wrong_kinds or box.at_world is None:
            return False
        near = [
            np.linalg.norm(c - box.at_world) for name, c, _ in self.objects if name == box.label
        ]
        doubt = [np.linalg.norm(c - box.at_world) for c in self._unclear if box.label == "cup"]
        reach = {"cup": 0.3, "tv": 1.2}.get(box.label, 0.0)
        return min([*near, np.inf]) > reach and min([*doubt, np.inf]) > 0.4


def _moved(T: NDArray[np.float64], point: list[float]) -> NDArray[np.float64]:
    return transform_points(T, np.array([point]))[0]


def detector_rows() -> Iterator[Row]:
    """Measure the real detector, then the simulated one where it can be compared."""
    if KITCHEN.is_dir() and MODEL.exists():
        kitchen = Kitchen()
        yield from right_rows(kitchen)
        wrong = [[b for b in view.boxes if kitchen.is_wrong(b)] for view in kitchen.views]
        yield from wrong_rows(wrong, len(kitchen.wrong_kinds), "redkitchen")
        yield from surface_rows(kitchen, wrong)
        yield from like_rows(kitchen.views, wrong, "redkitchen")
    else:
        sys.stderr.write(f"left out: the kitchen or the detector is not in {SHARED}\n")
    views, wrong, labels = simulated()
    yield from wrong_rows(wrong, labels, "homes")
    yield from like_rows(views, wrong, "homes")
    yield from bound_rows()


def right_rows(kitchen: Kitchen) -> Iterator[Row]:
    """Return how objects that are in view are scored, by size and by distance."""
    by_size: dict[float, list[float]] = defaultdict(list)
    by_range: dict[float, list[float]] = defaultdict(list)
    shown = functools.cache(lambda n, smaller: kitchen.detect(kitchen.views[n], smaller))
    for (n, view), (label, centre, size_m) in itertools.product(
        enumerate(kitchen.views), kitchen.objects
    ):
        pixel = view.pixel(centre, size_m)
        if pixel is None:
            continue
        u, v, z = pixel
        margin = min(0.5 * view.camera.fx * size_m / z, 100.0)
        width, height = view.camera.width, view.camera.height
        if not (margin <= u < width - margin and margin <= v < height - margin):
            continue
        best = _best(view.boxes, label, centre)
        by_range[_bin(z, RANGES_M)].append(0.0 if best is None else best.score)
        if best is None:
            continue
        for smaller in SHRUNK:
            boxes = view.boxes if smaller == 1 else shown(n, smaller)
            mine = [b.score for b in boxes if b.label == label and _overlap(b, best) > SAME_SHARE]
            by_size[_bin(best.side_px / smaller, SIZES_PX)].append(max(mine, default=0.0))
    for what, bins, found in (("px", SIZES_PX, by_size), ("m", RANGES_M, by_range)):
        for low, high in itertools.pairwise(bins):
            scores = np.array(found[low])
            data = f"redkitchen, {low:g} to {high:g} {what}, {len(scores)} views"
            for least in (0.05, 0.3, 0.5) if len(scores) >= 5 else ():
                share = float((scores >= least).mean())
                yield Row(name=f"objects scored {least:g} or more", data=data, value=share)


def wrong_rows(wrong: list[list[Box]], kinds: int, data: str) -> Iterator[Row]:
    """Return how many wrong boxes an image has for each kind of thing, and how large they are."""
    boxes = [box for of_image in wrong for box in of_image]
    for least in SCORES:
        count = sum(box.score >= least for box in boxes) / len(wrong) / kinds
        name = f"wrong boxes of a kind, scored {least:g} or more"
        yield Row(name=name, data=data, value=count, unit="an image")
    some = [box for box in boxes if box.score >= WRONG_FROM]
    labels = sorted({box.label for box in some})
    rates = [sum(box.label == label for box in some) / len(wrong) for label in labels]
    if len(labels) <= FEW_KINDS:
        for label, rate in zip(labels, rates, strict=True):
            name = f"wrong boxes of {label}, scored {WRONG_FROM:g} or more"
            yield Row(name=name, data=data, value=rate, unit="an image")
    for share in (10, 50, 90):
        name = f"wrong boxes from {WRONG_FROM:g}, {share} % of the kinds below"
        yield Row(name=name, data=data, value=float(np.percentile(rates, share)), unit="an image")
        sides = [b.side_px for b in some]
        name = f"their side, {share} % below"
        yield Row(name=name, data=data, value=float(np.percentile(sides, share)), unit="px")


def surface_rows(kitchen: Kitchen, wrong: list[list[Box]]) -> Iterator[Row]:
    """Return how many wrong boxes lie on each kind of surface, relative to its pixels."""
    pixels, boxes = np.zeros(3), np.zeros(3)
    for view, of_image in zip(kitchen.views, wrong, strict=True):
        kind = surface_kind(view)
        pixels += [(kind == k).sum() for k in range(3)]
        for box in of_image:
            left, top, right, bottom = (int(x) for x in box.box_px)
            w, h = right - left, bottom - top
            middle = kind[top + h // 4 : bottom - h // 4 + 1, left + w // 4 : right - w // 4 + 1]
            count = np.bincount(middle[middle >= 0], minlength=3)
            if box.score >= WRONG_FROM and count.any():
                most = int(count[:2].argmax())
                boxes[most if count[most] > 0.7 * count.sum() else 2] += 1
    for k, name in enumerate(("level", "upright", "cluttered")):
        share = float(boxes[k] / boxes.sum())
        relative = share / float(pixels[k] / pixels.sum())
        yield Row(name=f"wrong boxes on {name} surfaces", data="redkitchen", value=share)
        yield Row(name=f"relative to {name} pixels", data="redkitchen", value=relative)


def surface_kind(view: View) -> NDArray[np.int64]:
    """Return (H, W) 0 on level, 1 on upright planes, 2 elsewhere, -1 without depth."""
    c, z = view.camera, view.depth.astype(np.float64)
    v, u = np.mgrid[: c.height, : c.width]
    points = np.stack([(u - c.cx) / c.fx * z, (v - c.cy) / c.fy * z, z], axis=-1)
    step = 4
    across, down = np.zeros_like(points), np.zeros_like(points)
    across[:, step:-step] = points[:, 2 * step :] - points[:, : -2 * step]
    down[step:-step] = points[2 * step :] - points[: -2 * step]
    normal = np.cross(across, down)
    length = np.linalg.norm(normal, axis=-1)
    up = np.abs(normal @ view.T_world_camera[2, :3]) / np.maximum(length, 1e-12)
    jump = np.linalg.norm(across, axis=-1) + np.linalg.norm(down, axis=-1) > 0.08 * z
    kind = np.where(up > _FLAT, 0, np.where(up < _UPRIGHT, 1, 2))
    kind[jump | (length == 0.0)] = 2
    kind[(z <= 0.0) | (z > 4.0)] = -1
    return kind


def like_rows(views: list[View], wrong: list[list[Box]], data: str) -> Iterator[Row]:
    """Return how often a wrong box is there again where another image shows its place."""
    again: dict[str, list[bool]] = defaultdict(list)
    eyes = [view.T_world_camera[:3, 3] for view in views]
    for n, box in ((n, b) for n, of_image in enumerate(wrong) for b in of_image):
        at = box.at_world
        if box.score < WRONG_FROM or at is None:
            continue
        for m, view in enumerate(views):
            pixel = view.pixel(at)
            if m == n or pixel is None:
                continue
            u, v, z = pixel
            inner = 40 <= u < view.camera.width - 40 and 40 <= v < view.camera.height - 40
            if not inner or float(view.depth[int(v), int(u)]) > z + SAME_M:
                continue
            a, b = eyes[n] - at, eyes[m] - at
            cos = float(a @ b) / float(np.linalg.norm(a) * np.linalg.norm(b))
            angle = np.degrees(np.arccos(np.clip(cos, -1.0, 1.0)))
            there = any(
                o.label == box.label
                and o.score >= WRONG_FROM
                and o.at_world is not None
                and np.linalg.norm(o.at_world - at) < SAME_M
                for o in wrong[m]
            )
            again[_likeness(float(angle), float(np.linalg.norm(a - b)))].append(there)
    for key in sorted(again):
        name = f"the same wrong box again, {key}"
        yield Row(name=name, data=f"{data}, {len(again[key])} pairs", value=np.mean(again[key]))


def simulated() -> tuple[list[View], list[list[Box]], int]:
    """Return views of the simulated detector in homes, its wrong boxes, and the number of labels.

    The robot turns and drives a little at each start.
    """
    from ippon.geometry import base_pose
    from ippon.guidance.language.naming import is_instance_of
    from ippon.robot import HABITAT
    from ippon.simulation.camera.renderer import SceneRenderer
    from ippon.simulation.homes.generator import generate_home
    from ippon.simulation.robot.mobile_base import camera_of
    from ippon.simulation.segmentation.detector import SimulatedDetector
    from ippon.vocabulary import MATTERPORT_40

    camera = camera_of(HABITAT, 240)
    views: list[View] = []
    wrong: list[list[Box]] = []
    labels = 1
    for seed in range(4101, 4105):
        scene = generate_home(seed)
        renderer = SceneRenderer(scene)
        present = {i.category for i in scene.instances} | {"cup"}
        detector = SimulatedDetector(scene, MATTERPORT_40, "cup", None, seed, is_instance_of)
        for start in scene.start_poses[:2]:
            for k in range(20):
                yaw = start.yaw + np.radians(4.0 * k)
                forward = 0.03 * k * np.array([np.cos(start.yaw), np.sin(start.yaw)])
                T = base_pose(start.x + forward[0], start.y + forward[1], start.z, yaw)
                T = T @ HABITAT.T_base_camera(-0.3)
                picture = renderer.render(camera, T)
                view = View(camera, T, picture.depth, picture.color, ())
                found = detector.detect(picture, camera, T, k)
                labels = len(set(found.labels) - present)
                boxes = boxes_of(found, view)
                wrong.append([b for b in boxes if b.label not in present])
                views.append(view)
    return views, wrong, labels


def bound_rows() -> Iterator[Row]:
    """Return what no bar on the mean score of four views can avoid, with the simulated detector.

    Views are from nearby: nothing is lost by small size. Errors of things and places are drawn from
    its distributions, places of false detections from homes.
    """
    from ippon.guidance.language.naming import is_instance_of
    from ippon.simulation.homes.generator import generate_home
    from ippon.simulation.segmentation.detector import DetectorConfig, SimulatedDetector
    from ippon.vocabulary import MATTERPORT_40

    config, bar = DetectorConfig(), 0.3
    missed = float((_four_views(config.right, 0.0) < bar).mean())
    data = "drawn, four views from nearby"
    yield Row(name=f"objects scored below {bar:g}", data=data, value=100.0 * missed, unit="%")
    for sigmas in (0.0, 1.0):
        share = float((_four_views(config.wrong, sigmas) >= bar).mean())
        name = f"places of no object above it, label {sigmas:+g} sigma: one in"
        yield Row(name=name, data=data, value=1.0 / max(share, 1.0 / DRAWN))
    counts: list[int] = []
    for seed in range(4101, 4104):
        detector = SimulatedDetector(
            generate_home(seed), MATTERPORT_40, "cup", None, seed, is_instance_of
        )
        count = np.bincount(detector._places.label)
        counts += [int(count[detector._told.index(label)]) for label in BOUND_LABELS]
    for what, value in (("fewest", min(counts)), ("most", max(counts))):
        data = f"3 homes, {', '.join(BOUND_LABELS)}"
        yield Row(name=f"places of a label, {what}", data=data, value=value)


def _four_views(scores: Any, label_sigmas: float) -> NDArray[np.float64]:
    rng = np.random.default_rng(0)
    lasting = scores.mean + scores.label_sigma * label_sigmas
    lasting = lasting + scores.thing_sigma * rng.normal(size=(DRAWN, 1))
    by_view = scores.view_sigma * rng.normal(size=(DRAWN, 4))
    by_frame = scores.frame_sigma * rng.normal(size=(DRAWN, 4))
    return (1.0 / (1.0 + np.exp(-lasting - by_view - by_frame))).mean(axis=1)


def _likeness(angle: float, distance_m: float) -> str:
    if angle < 5.0 and distance_m < 0.2:
        return "from 5 degrees and 0.2 m"
    if angle < 15.0 and distance_m < 0.5:
        return "from 15 degrees and 0.5 m"
    if angle < 30.0 and distance_m < 1.0:
        return "from 30 degrees and 1 m"
    return "from elsewhere"


def _best(boxes: tuple[Box, ...], label: str, centre: NDArray[np.float64]) -> Box | None:
    near = [
        box
        for box in boxes
        if box.label == label
        and box.at_world is not None
        and float(np.linalg.norm(box.at_world - centre)) <= NEAR_M[label]
    ]
    return max(near, key=lambda box: box.score, default=None)


def _overlap(a: Box, b: Box) -> float:
    """Return the intersection of two boxes over their union."""
    low = np.maximum(a.box_px[:2], b.box_px[:2])
    high = np.minimum(a.box_px[2:], b.box_px[2:])
    both = float(np.maximum(high - low, 0.0).prod())
    return both / (a.side_px**2 + b.side_px**2 - both)


def _bin(value: float, edges: tuple[float, ...]) -> float:
    return max((edge for edge in edges if edge <= value), default=edges[0])
