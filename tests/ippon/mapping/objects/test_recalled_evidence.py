import numpy as np
import pytest

from ippon.mapping.arrays import OCCUPIED
from ippon.mapping.config import MapConfig
from ippon.mapping.objects.recalled_evidence import (
    posterior_of,
    recall_evidence,
    withdraw_evidence,
)
from ippon.mapping.voxel_map import VoxelMap
from ippon.observation import Heatmap
from ippon.observation_model import NOTHING_SAID

LABELS = ("wall", "table")
LOG_ODDS = float(np.log(9.0))


def _walls(seen):
    """A heatmap that shows walls everywhere, and no hat."""
    probabilities = np.zeros((*seen.shape, 3), np.uint8)
    probabilities[..., 0] = 255
    return Heatmap(labels=LABELS, ooi="hat", probabilities=probabilities)


@pytest.fixture
def known(tools):
    """A map of a room with a box on the floor, the room without it, and where the box was."""
    room = tools.World.room()
    box = (2.4, 1.9, 0.0, 2.7, 2.2, 0.25)
    world = tools.World([*room.boxes, box])
    voxel_map = VoxelMap(MapConfig(voxel_size_m=0.1), LABELS)
    voxel_map.set_ooi("hat")
    for _ in range(6):
        voxel_map.integrate(world.frame(tools.look(1.0, 2.0, 1.2, 0.0, -0.5)))
    return voxel_map, room, (np.array([2.55, 2.05, 0.12]), np.array([0.4, 0.4, 0.4]))


def test_only_surface_beside_free_space_is_recalled(known):
    voxel_map, _, box = known
    recalled = recall_evidence(voxel_map, *box, LOG_ODDS)
    assert len(recalled.voxels) > 5
    assert posterior_of(voxel_map.arrays(), recalled.voxels) == pytest.approx(0.9, abs=0.01)
    buried = np.array([[25, 20, -1]])
    assert not (recalled.voxels == buried).all(axis=1).any()


@pytest.mark.slow
def test_images_wear_it_off_and_the_rest_can_be_withdrawn(known, tools):
    voxel_map, room, box = known
    recalled = recall_evidence(voxel_map, *box, LOG_ODDS)
    for n in range(40):
        pose = tools.look(1.0, 2.0, 1.2, 0.0, -0.5)
        voxel_map.integrate(room.frame(pose, stamp_ns=n * 10**8, heatmap=_walls))
    left = posterior_of(voxel_map.arrays(), recalled.voxels)
    assert (left < 0.3).mean() > 0.6
    arrays = voxel_map.arrays()
    withdraw_evidence(voxel_map, recalled)
    assert posterior_of(voxel_map.arrays(), recalled.voxels).max() < 0.5
    occupied = arrays.state[: len(arrays.revision)] == OCCUPIED
    assert occupied.any(), "the room itself stays"


def test_what_was_withdrawn_is_as_before(known):
    voxel_map, _, box = known
    before = voxel_map.best_ooi()
    revision = voxel_map.revision
    withdraw_evidence(voxel_map, recall_evidence(voxel_map, *box, LOG_ODDS))
    assert voxel_map.best_ooi() == before
    assert voxel_map.revision > revision


def test_an_image_that_says_nothing_leaves_what_is_recalled(known, tools):
    """Also where the place of the images was seen before the thing was recalled."""
    voxel_map, _, box = known

    def nothing_said(seen):
        p = np.full((*seen.shape, 1), NOTHING_SAID, np.uint8)
        return Heatmap(labels=(), ooi="hat", probabilities=p, kind="scores")

    def look():
        pose, world = tools.look(1.0, 2.0, 1.2, 0.0, -0.5), tools.World.room()
        world.boxes.append((2.4, 1.9, 0.0, 2.7, 2.2, 0.25))
        voxel_map.integrate(world.frame(pose, heatmap=nothing_said))

    look()
    recalled = recall_evidence(voxel_map, *box, LOG_ODDS)
    look()
    assert np.median(posterior_of(voxel_map.arrays(), recalled.voxels)) == pytest.approx(
        0.9, abs=0.02
    )
    again = recall_evidence(voxel_map, *box, 2.0 * LOG_ODDS)
    withdraw_evidence(voxel_map, again)
    look()
    assert np.median(posterior_of(voxel_map.arrays(), recalled.voxels)) == pytest.approx(
        0.9, abs=0.02
    )
