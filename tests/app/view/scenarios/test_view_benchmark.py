"""What a change costs, for maps of several sizes: `scripts/test -m benchmark tests/app/view`.

Figures stand in `docs/results.md`.
"""

import itertools

import numpy as np
import pytest

from app.messages.scene import VoxelCloud, decode_voxels, encode_voxels
from app.view.drawing.viser_scene import ALL_PARTS, ViserScene
from app.view.model.scene_model import SceneModel
from app.view.view_options import ViewOptions

pytestmark = pytest.mark.benchmark

CHANGED = 2000
SIZES = [20_000, 200_000, pytest.param(1_000_000, marks=pytest.mark.large)]


def home_of(voxels):
    """A floor with walls every four metres: (N, 3) indices of about so many surface voxels."""
    side = round((voxels / 2.2) ** 0.5)
    i, j = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    floor = np.stack([i, j, np.zeros_like(i)], axis=-1).reshape(-1, 3)
    wall = floor[((floor[:, 0] % 40) == 0) | ((floor[:, 1] % 40) == 0)]
    walls = np.concatenate([wall + np.array([0, 0, k]) for k in range(1, 26)])
    return np.concatenate([floor, walls])[:voxels]


def cloud_of_home(indices, stamp_ns, shade):
    n = len(indices)
    rng = np.random.default_rng(stamp_ns)
    return VoxelCloud(
        stamp_ns=stamp_ns,
        centers_world=((indices + 0.5) * 0.1).astype(np.float32),
        color=(rng.integers(60, 200, (n, 3)) + shade).astype(np.uint8),
        ooi=rng.integers(0, 60, n).astype(np.uint8),
        proximity=np.full(n, 20, np.uint8),
        level=rng.integers(0, 4, n).astype(np.uint8),
        label=np.full(n, 3, np.uint8),
        confidence=np.full(n, 200, np.uint8),
        removed=np.zeros(n, bool),
    )


def view_of(indices):
    """Return the nearest voxels in front of a robot in the middle of the map."""
    center = np.median(indices, axis=0)
    ahead = indices - center
    seen = (ahead[:, 0] >= 0) & (np.abs(ahead[:, 1]) <= ahead[:, 0] * 0.75)
    rows = np.flatnonzero(seen)
    return indices[rows[np.argsort(np.abs(ahead[rows]).sum(axis=1))[:CHANGED]]]


@pytest.mark.parametrize("voxels", SIZES)
def test_a_change_of_2000_voxels(benchmark, server, make, voxels):
    indices = home_of(voxels)
    model = SceneModel()
    model.on_status(make.status())
    scene = ViserScene(server)
    model.on_keyframe(cloud_of_home(indices, 1, 0))
    scene.draw(model, ALL_PARTS, ViewOptions())
    model.take_changes()
    seen = view_of(indices)
    payloads = itertools.cycle(
        [encode_voxels(cloud_of_home(seen, n, n % 50)) for n in range(2, 40)]
    )

    def change():
        model.on_voxels(decode_voxels(next(payloads)))
        scene.draw(model, model.take_changes(), ViewOptions())

    messages, size = sent_by(server, change)
    benchmark.extra_info |= {"messages": messages, "kilobytes": round(size / 1e3, 1)}
    benchmark.pedantic(change, rounds=30, warmup_rounds=2)


def sent_by(server, change):
    """Return how many messages a change queues, and the bytes of their arrays."""
    buffer = server._websock_server._broadcast_buffer
    first = buffer.message_counter
    change()
    queued = [message for n, message in buffer.message_from_id.items() if n >= first]
    arrays = [
        value.nbytes
        for message in queued
        for value in getattr(message, "updates", {}).values()
        if isinstance(value, np.ndarray)
    ]
    return buffer.message_counter - first, sum(arrays)


@pytest.mark.parametrize("voxels", SIZES)
def test_a_switch_of_the_colour_mode(benchmark, server, make, voxels):
    model = SceneModel()
    model.on_status(make.status())
    scene = ViserScene(server)
    model.on_keyframe(cloud_of_home(home_of(voxels), 1, 0))
    scene.draw(model, ALL_PARTS, ViewOptions())
    modes = iter(["ooi", "proximity", "height", "camera"] * 10)
    benchmark.pedantic(
        lambda: scene.draw(model, frozenset(), ViewOptions(mode=next(modes))), rounds=4
    )


@pytest.mark.parametrize("voxels", SIZES)
def test_a_keyframe(benchmark, server, make, voxels):
    payload = encode_voxels(cloud_of_home(home_of(voxels), 1, 0))

    def load():
        model = SceneModel()
        model.on_status(make.status())
        model.on_keyframe(decode_voxels(payload))
        scene = ViserScene(server)
        scene.draw(model, ALL_PARTS, ViewOptions())

    benchmark.extra_info["kilobytes"] = len(payload) // 1000
    benchmark.pedantic(load, rounds=2)
