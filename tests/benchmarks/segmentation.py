"""Networks with random weights, heatmap messages, and second passes.

On a machine with a GPU the networks run there, in half precision, as they are and compiled.
"""

import statistics
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from app.messages.perception.heatmaps import decode_heatmap, encode_heatmap
from ippon.camera import PinholeCamera
from ippon.observation import Heatmap
from ippon.robot import ZED
from ippon.segmentation.config import SegmentationConfig
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.world import SimulatedWorld
from ippon.vocabulary import MATTERPORT_40
from tests.benchmarks.rows import Row

REPEATS = 10
KEPT = (1, 2, 4, 8)


def segmentation_rows(quick: bool) -> Iterator[Row]:
    """Measure all of it; `quick` leaves the second passes out."""
    yield from message_rows()
    yield from network_rows()
    from tests.benchmarks.full_size_networks import full_size_rows

    yield from full_size_rows()
    if not quick:
        from tests.benchmarks.segmentation_passes import pass_rows

        yield from pass_rows(quick=False)


def network_rows() -> Iterator[Row]:
    """Time SAN on an image of 640x640 with 41 labels."""
    import torch

    from app.doctor.segmentation_speed import measure, random_san

    plain = SegmentationConfig()
    ways = {"": plain}
    if torch.cuda.is_available():
        ways["compiled, "] = replace(plain, compile=True)
        where = f"{torch.cuda.get_device_name()}, float16"
    else:
        torch.set_num_threads(1)
        where = "one processor core, float32"
    for name in ("san_vit_b_16", "san_vit_large_14"):
        for way, config in ways.items():
            speed = measure(random_san(name, config), "")
            data = f"640x640, 41 labels, {way}{where}"
            yield Row(name=name, data=data, median_ms=1e3 * speed.image_s)
            yield Row(name=name, data=data, value=1.0 / speed.image_s, unit="images/s")
            yield Row(name=f"{name}, first image more", data=data, median_ms=1e3 * speed.labels_s)


def message_rows() -> Iterator[Row]:
    """Measure bytes, times and losses of heatmap messages of a simulated network."""
    heatmaps = _heatmaps()
    for keep in (*KEPT, None):
        packed = [encode_heatmap(heatmap, 1, "camera", keep=keep) for heatmap in heatmaps]
        data = f"{'all' if keep is None else keep} labels a pixel of 41, 160x120"
        size = statistics.median(len(message) for message in packed)
        yield Row(name="heatmap message", data=data, value=size / 1e3, unit="kB")
        yield Row(name="heatmap message, write", data=data, median_ms=_write_ms(heatmaps, keep))
        loss = [_loss(h, decode_heatmap(m).heatmap) for h, m in zip(heatmaps, packed, strict=True)]
        lost = 100 * statistics.mean(loss)
        yield Row(name="heatmap message, probability misplaced", data=data, value=lost, unit="%")


def _heatmaps() -> list[Heatmap]:
    scene = generate_home(2001)
    camera = PinholeCamera.from_horizontal_fov(320, 240, ZED.horizontal_fov_rad)
    found: list[Heatmap] = []
    for start in scene.start_poses[:REPEATS]:
        world = SimulatedWorld(scene, ZED, camera, start)
        world.set_labels(MATTERPORT_40, "hat")
        heatmap = world.observe().heatmap
        assert heatmap is not None
        found.append(heatmap)
    return found


def _write_ms(heatmaps: list[Heatmap], keep: int | None) -> float:
    times: list[float] = []
    for heatmap in heatmaps:
        started = time.perf_counter()
        encode_heatmap(heatmap, 1, "camera", keep=keep)
        times.append(1e3 * (time.perf_counter() - started))
    return statistics.median(times)


def _loss(sent: Heatmap, came: Heatmap) -> float:
    """Return the share of probability that lies on another label than before."""
    change = sent.probabilities.astype(np.int64) - came.probabilities
    return float(np.abs(change).sum() / 2.0 / sent.probabilities.sum())
