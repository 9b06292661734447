"""Recognition of small things with and without a second pass over a crop, on simulated networks.

The simulated network misses what fills little of the image it is given (half of the time at 0.07 %
of it), so a crop helps it, as it helps a real network, whose patches are 16 pixels wide. What a
crop cannot give is detail that the camera has not: `GAINS` says how much more of it there is than
the network sees in the whole image. 1 is a camera no finer than the network (a control: a crop
shows it nothing new), 1.6 one of 1280x720 before a network of 640, 3.5 one of 1920x1200. Loss with
range, lasting misreadings of an object, flicker, and bad patches of the image are the same in a
crop.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ippon.camera import PinholeCamera
from ippon.observation import Heatmap
from ippon.segmentation.crop_segmenter import CropSegmenter
from ippon.segmentation.segmenter import Segmenter
from ippon.simulation.camera.renderer import Rendering, SceneRenderer
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.scene import Instance, Scene
from ippon.simulation.segmentation.segmenter import SegmenterConfig, SimulatedSegmenter
from ippon.vocabulary import MATTERPORT_40, canonical_label
from tests.benchmarks.rows import Row

HOMES = range(2001, 2009)
THINGS = 8
SMALL_M = 0.3
BANDS_M = ((1.0, 1.5), (2.0, 3.0), (3.5, 5.0))
GAINS = (1.0, 1.6, 3.5)
FRAMES = 4
"""Frames at each viewpoint; the tiles take turns over them."""
LEAST_PIXELS = 8
FALSE_PIXELS = 12
"""Pixels of a heatmap that are firmly, and wrongly, the object of interest: a false alarm."""
CAMERA = PinholeCamera.from_horizontal_fov(320, 240, math.radians(74.0))


class SimulatedNetwork:
    """A `Segmenter` of the picture it was shown last; colours are the numbers of its pixels."""

    def __init__(self, scene: Scene, seed: int, gain: float) -> None:
        self._scene, self._seed, self._gain = scene, seed, gain
        self._networks: dict[object, SimulatedSegmenter] = {}
        self._rendering: Rendering | None = None
        self._eye = np.zeros(3)
        self._frame = 0

    def show(self, rendering: Rendering, eye: np.ndarray, frame: int) -> np.ndarray:
        """Take a picture to segment; return an image that says which part of it a crop is."""
        self._rendering, self._eye, self._frame = rendering, eye, frame
        numbers = np.arange(rendering.instance.size).reshape(rendering.instance.shape)
        return np.stack([numbers & 255, numbers >> 8 & 255, numbers >> 16], axis=2).astype(np.uint8)

    def segment(self, color: np.ndarray, labels: Sequence[str], ooi: str | None) -> Heatmap:
        """Segment the part of the picture that the image says."""
        whole = self._rendering
        assert whole is not None
        first = int(color[0, 0].astype(np.int64) @ (1, 256, 65536))
        top, left = divmod(first, whole.instance.shape[1])
        part = (slice(top, top + color.shape[0]), slice(left, left + color.shape[1]))
        height, width = whole.instance.shape
        extent = (color.shape[0] / height, color.shape[1] / width)
        share = extent[0] * extent[1]
        rendering = Rendering(
            color=whole.color[part], depth=whole.depth[part], instance=whole.instance[part]
        )
        network = self._network(tuple(labels), ooi, round(min(1.0 / share, 100.0), 3))
        window = (top / height, left / width, *extent)
        return network.segment(rendering, self._eye, self._frame, window)

    def _network(self, labels: tuple[str, ...], ooi: str | None, zoom: float) -> SimulatedSegmenter:
        key = (labels, ooi, zoom)
        if key not in self._networks:
            usual = SegmenterConfig()
            # A thing fills `zoom` times more of the crop; only `gain` times more of it is detail.
            missed = usual.missed_share * zoom / min(zoom, self._gain)
            config = replace(usual, missed_share=missed)
            self._networks[key] = SimulatedSegmenter(self._scene, labels, ooi, config, self._seed)
        return self._networks[key]


@dataclass
class Tally:
    """Frames, and in how many the thing was found, and something else was taken for it."""

    frames: int = 0
    found: int = 0
    false: int = 0

    def add(self, heatmap: Heatmap, truth: np.ndarray) -> None:
        """Judge a heatmap; `truth` (H, W) is where the object of interest is."""
        channel = heatmap.ooi_channel
        assert channel is not None
        p = heatmap.probabilities[..., channel]
        v = (np.arange(p.shape[0]) + 0.5) * truth.shape[0] / p.shape[0]
        u = (np.arange(p.shape[1]) + 0.5) * truth.shape[1] / p.shape[1]
        there = truth[v.astype(int)[:, None], u.astype(int)]
        self.frames += 1
        self.found += bool(there.any() and p[there].mean() > 127)
        self.false += int((p[~there] > 127).sum()) >= FALSE_PIXELS


def pass_rows(quick: bool) -> Iterator[Row]:
    """Measure on small things of generated homes, seen from near and far."""
    homes = HOMES[:2] if quick else HOMES
    tallies: dict[tuple[str, str], Tally] = {}
    for seed in homes:
        scene = generate_home(seed)
        _look_at_things(scene, seed, tallies)
    for (method, data), tally in tallies.items():
        where = f"{data}, {tally.frames} frames"
        yield Row(
            name=f"found, {method}", data=where, value=100 * tally.found / tally.frames, unit="%"
        )
        yield Row(
            name=f"false, {method}", data=where, value=100 * tally.false / tally.frames, unit="%"
        )


def _look_at_things(scene: Scene, seed: int, tallies: dict[tuple[str, str], Tally]) -> None:
    renderer = SceneRenderer(scene)
    rng = np.random.default_rng(seed)
    networks = {gain: SimulatedNetwork(scene, seed, gain) for gain in GAINS}
    methods = _methods(networks)
    names = [canonical_label(instance.label) for instance in scene.instances]
    for k in _small_things(scene, rng):
        for near, far in BANDS_M:
            pose = _view_of(scene.instances[k], rng.uniform(near, far), rng)
            rendering = renderer.render(CAMERA, pose)
            if (rendering.instance == k).sum() < LEAST_PIXELS:
                continue
            ooi = names[k]
            same = np.flatnonzero([name == ooi for name in names])
            truth = np.isin(rendering.instance, same)
            first = int(rng.integers(10_000)) * FRAMES
            for name, (network, segmenter) in methods.items():
                tally = tallies.setdefault((name, f"{near:g} to {far:g} m"), Tally())
                for frame in range(first, first + FRAMES):
                    image = network.show(rendering, pose[:3, 3], frame)
                    tally.add(segmenter.segment(image, MATTERPORT_40, ooi), truth)


def _methods(
    networks: dict[float, SimulatedNetwork],
) -> dict[str, tuple[SimulatedNetwork, Segmenter]]:
    plain = networks[GAINS[-1]]
    return {
        "one look": (plain, plain),
        **{f"crop, gain {g:g}": (n, CropSegmenter(n)) for g, n in networks.items()},
    }


def _small_things(scene: Scene, rng: np.random.Generator) -> list[int]:
    """Choose things that the vocabulary does not name."""
    small = [
        k
        for k, instance in enumerate(scene.instances)
        if canonical_label(instance.label) not in MATTERPORT_40
        and max(np.subtract(instance.aabb_max, instance.aabb_min)) < SMALL_M
    ]
    return sorted(rng.permutation(small)[:THINGS].tolist())


def _view_of(instance: Instance, distance_m: float, rng: np.random.Generator) -> np.ndarray:
    """Return a camera pose at head height that has a thing somewhere in view."""
    centre = np.add(instance.aabb_min, instance.aabb_max) / 2.0
    bearing = rng.uniform(-math.pi, math.pi)
    eye = centre + distance_m * np.array([math.cos(bearing), math.sin(bearing), 0.0])
    eye[2] = 1.2
    forward = centre - eye
    yaw = math.atan2(forward[1], forward[0]) + rng.uniform(-0.4, 0.4)
    pitch = math.atan2(forward[2], math.hypot(forward[0], forward[1])) + rng.uniform(-0.25, 0.25)
    ahead = np.array(
        [math.cos(yaw) * math.cos(pitch), math.sin(yaw) * math.cos(pitch), math.sin(pitch)]
    )
    right = np.array([math.sin(yaw), -math.cos(yaw), 0.0])
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(ahead, right), ahead], axis=1)
    pose[:3, 3] = eye
    return pose
