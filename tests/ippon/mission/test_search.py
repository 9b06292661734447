"""What a search makes of what may be the object."""

from collections import deque
from dataclasses import replace

import numpy as np
import pytest

from ippon.geometry import base_pose
from ippon.guidance.language.goals.goal import Attribute
from ippon.guidance.prior import EmbeddedPrior
from ippon.mapping.config import MapConfig
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.config import MissionConfig
from ippon.mission.finds.find_geometry import exclusion_sphere
from ippon.mission.finds.image_check import _Track
from ippon.mission.finds.rejection import (
    count_known,
    is_clear_of,
    readmit_most_likely,
    set_aside,
    update_candidates,
)
from ippon.mission.goal import Goal
from ippon.mission.search import Search
from ippon.mission.snapshot import Find, JudgedAttribute
from ippon.vocabulary import MATTERPORT_40


def speck(x=1.0, voxels=1, probability=1.0):
    return Find(
        position_world=(x, 0.0, 0.5),
        size_m=(0.1, 0.1, 0.1),
        probability=probability,
        voxels=voxels,
        box_px=None,
    )


@pytest.fixture
def searching(monkeypatch):
    """Search for something of which the images say a given share."""

    def make(share, goal="mug", category=None, voxel_m=0.1):
        config = MissionConfig()
        config = replace(config, map=replace(config.map, voxel_size_m=voxel_m))
        guidance = EmbeddedPrior().levels(goal, "", MATTERPORT_40)
        search = Search(
            Goal(goal_id=1, object=goal, display=goal, context="", category=category),
            guidance,
            config,
        )
        votes = None
        if share is not None:
            votes = _Track(
                centre=np.zeros(3), shares=deque([share]), by_instance=False, points=deque()
            )
        monkeypatch.setattr(search.image_check, "_track_with_enough", lambda _: votes)
        return search

    return make


@pytest.mark.parametrize(
    ("share", "find", "shows"),
    [
        (0.6, speck(), True),
        (0.4, speck(), False),
        (None, speck(), False),
        (0.6, speck(probability=0.9), False),
        (0.6, speck(x=2.5), False),
        (0.6, speck(voxels=2), False),
    ],
    ids=["sure", "unlike it", "few images", "unsure map", "far away", "enough of it"],
)
def test_a_single_voxel_counts_if_map_and_images_are_sure(searching, share, find, shows):
    search = searching(share)
    search.candidates = (find,)
    assert search.shows_single_voxel(base_pose(0.0, 0.0, 0.0, 0.0)) is shows


def test_a_few_voxels_are_never_a_large_object(searching):
    search = searching(0.9, goal="bed", category="bed")
    search.candidates = (speck(),)
    assert not search.shows_single_voxel(base_pose(0.0, 0.0, 0.0, 0.0))


def test_half_of_t_min_is_enough_from_then_on(searching):
    search = searching(0.6)
    assert search.termination_min == 1.0
    search.relaxed_termination = True
    assert search.termination_min == 0.5


@pytest.mark.parametrize(
    ("share", "probability", "doubt"),
    [
        (0.6, 1.0, None),
        (0.4, 1.0, "shows too little to be sure"),
        (0.9, 0.9, "shows too little to be sure"),
        (None, 1.0, "shows too little to be sure"),
    ],
)
def test_few_voxels_of_a_small_object_must_be_sure(searching, share, probability, doubt):
    search, find = searching(share), speck(probability=probability)
    assert search.objection(find, elsewhere=False) is None, "two such voxels ended the search"
    search.relaxed_termination = True
    assert search.objection(find, elsewhere=False) == doubt
    search.reconsidered.append(exclusion_sphere(search.exclusion, find))
    assert search.objection(find, elsewhere=False) is None, "nothing better is left"


def test_the_reason_of_a_doubt_is_the_one_that_decides(searching):
    find = speck(voxels=5)
    assert searching(0.1).objection(find, elsewhere=False) == "hardly looks like it"
    assert searching(0.4).objection(find, elsewhere=False) is None
    assert searching(0.4).objection(find, elsewhere=True) == "is not where you said"
    assert searching(0.6).objection(find, elsewhere=True) is None


@pytest.mark.parametrize(("voxel_m", "against"), [(0.1, True), (0.05, False)])
def test_what_is_mere_outline_depends_on_the_voxels_size(searching, voxel_m, against):
    search = searching(0.3, voxel_m=voxel_m)
    doubt = search.objection(speck(voxels=20), elsewhere=False)
    assert (doubt is not None) is against
    assert np.isfinite(search.termination_min)


@pytest.mark.parametrize(
    ("goal", "size_m", "voxels", "doubt"),
    [
        ("mug", (0.6, 0.6, 0.8), 54, "is too large"),
        ("mug", (0.3, 0.2, 0.2), 6, None),
        ("book", (1.8, 0.3, 0.3), 60, None),
        ("toilet", (0.1, 0.1, 0.3), 3, "shows too little to be sure"),
        ("toilet", (0.3, 0.2, 0.2), 4, "shows too little to be sure"),
        ("toilet", (0.4, 0.5, 0.4), 20, None),
    ],
    ids=["a bin for a mug", "a mug", "a row of books", "a strip of wall", "a part", "a toilet"],
)
def test_a_find_has_the_size_of_the_object(searching, goal, size_m, voxels, doubt):
    search = searching(0.9, goal=goal)
    find = replace(speck(voxels=voxels), size_m=size_m)
    assert search.objection(find, elsewhere=False) == doubt
    search.reconsidered.append(exclusion_sphere(search.exclusion, find))
    later = doubt if doubt == "is too large" else None
    assert search.objection(find, elsewhere=False) == later, "with nothing better left"


@pytest.mark.parametrize(
    ("voxels", "probability", "enough"),
    [(6, 1.0, False), (7, 1.0, True), (15, 0.98, False), (16, 0.98, True)],
    ids=["T_min", "more", "unsure", "unsure of much"],
)
def test_an_unsure_posterior_demands_more_voxels_of_a_large_object(
    searching, voxels, probability, enough
):
    search = searching(0.9, goal="toilet", category="toilet")
    assert search.termination_min == 6.0
    find = replace(speck(voxels=voxels, probability=probability), size_m=(0.3, 0.3, 0.3))
    assert (search.objection(find, elsewhere=False) is None) is enough
    search.reconsidered.append(exclusion_sphere(search.exclusion, find))
    assert search.objection(find, elsewhere=False) is None, "with nothing better left"


def test_finds_that_are_too_large_are_reconsidered_last(searching):
    search = searching(0.9)
    voxel_map = VoxelMap(MapConfig(memory_limit_mb=64.0), MATTERPORT_40)
    bin_ = replace(speck(x=4.0, voxels=54), size_m=(0.6, 0.6, 0.8))
    set_aside(search, voxel_map, bin_)
    search.image_check.share = lambda _: 0.2
    set_aside(search, voxel_map, speck(x=0.0))
    assert [one.too_large for one in search.set_aside] == [True, False]
    assert readmit_most_likely(search, voxel_map)
    assert search.is_reconsidered(speck(x=0.0))
    assert not search.is_reconsidered(bin_)
    assert readmit_most_likely(search, voxel_map)
    assert search.objection(bin_, elsewhere=False) == "is too large", "it is what it was"
    set_aside(search, voxel_map, bin_)
    assert not readmit_most_likely(search, voxel_map)
    assert len(search.rejected) == 1


def test_a_large_thing_a_metre_from_one_that_is_counted_remains_a_candidate(searching):
    """Of two sofas that face each other one is found first."""
    search = searching(0.9, goal="sofa", category="sofa")
    search.goal = replace(search.goal, count=2)
    voxel_map = VoxelMap(MapConfig(memory_limit_mb=64.0), MATTERPORT_40)
    first = replace(speck(voxels=200), position_world=(0.0, 0.0, 0.4), size_m=(2.0, 0.9, 0.8))
    second = replace(first, position_world=(0.0, 1.9, 0.4))
    more = replace(speck(voxels=9), position_world=(0.9, 0.5, 0.4), size_m=(0.4, 0.4, 0.2))
    count_known(search, voxel_map, first)
    assert not search.is_rejected(second)
    assert is_clear_of(voxel_map, first, second)
    assert search.is_rejected(more), "the rest of the first one"


@pytest.mark.parametrize("away_m", [0.65, 0.8, 1.0])
def test_a_chair_beside_one_that_is_counted_remains_a_candidate(searching, away_m):
    """Nothing is known of the size of chairs."""
    search = searching(0.9, goal="chair")
    search.goal = replace(search.goal, count=2)
    voxel_map = VoxelMap(MapConfig(memory_limit_mb=64.0), MATTERPORT_40)
    first = replace(speck(voxels=60), position_world=(0.0, 0.0, 0.45), size_m=(0.5, 0.5, 0.9))
    second = replace(first, position_world=(away_m, 0.0, 0.45))
    legs = replace(speck(voxels=8), position_world=(0.3, 0.1, 0.2), size_m=(0.2, 0.3, 0.4))
    back = replace(speck(voxels=8), position_world=(0.0, 0.3, 0.8), size_m=(0.5, 0.1, 0.4))
    count_known(search, voxel_map, first)
    assert not search.is_rejected(second)
    assert search.is_rejected(legs)
    assert search.is_rejected(back)
    search.candidates = (second, legs)
    (continuation,) = search.take_continuations()
    assert continuation[0].alone, "no more of what stands beside it is excluded"
    assert search.candidates == (second,)
    search.rejected = [exclusion_sphere(search.exclusion, first)]
    assert search.is_rejected(second), "an operator's rejection reaches farther, as before"


def test_an_object_beside_a_rejected_find_remains_a_candidate(searching):
    """A toilet 1.3 m from a wrong find, as in a simulated home, begins at the excluded region."""
    search = searching(None, goal="toilet", category="toilet")
    wrong = replace(speck(voxels=32), position_world=(8.21, 8.47, 0.76), size_m=(0.7, 0.5, 0.4))
    toilet = replace(speck(voxels=50), position_world=(7.3, 7.52, 0.44), size_m=(0.5, 0.8, 0.8))
    more = replace(speck(voxels=4), position_world=(7.8, 8.1, 0.6), size_m=(0.3, 0.2, 0.2))
    region = exclusion_sphere(search.exclusion, wrong)
    search.rejected.append(region)
    search.candidates = (toilet, more)
    assert [entry for _, entry in search.take_continuations()] == [None]
    assert search.candidates == (toilet,)
    assert not search.is_rejected(toilet)
    search.reconsidered.append(region)
    assert search.is_reconsidered(more)
    assert not search.is_reconsidered(toilet)


def test_what_continues_a_doubted_find_is_readmitted_with_it(searching, monkeypatch):
    search = searching(0.9)
    voxel_map = VoxelMap(MapConfig(memory_limit_mb=64.0), MATTERPORT_40)
    set_aside(search, voxel_map, speck())
    monkeypatch.setattr(search, "update_candidates", lambda *_: None)
    search.candidates = (speck(x=1.2),)
    update_candidates(search, voxel_map, None)
    assert search.candidates == ()
    (entry,) = search.set_aside
    assert len(entry.excluded) == 2
    assert readmit_most_likely(search, voxel_map)


def test_a_find_out_of_reach_tells_what_is_unsure_of_it(searching):
    search = searching(0.6)
    search.find = replace(
        speck(),
        out_of_reach_m=1.4,
        attributes=(JudgedAttribute(value="red", kind="colour"),),
    )
    assert search.found_text(np.eye(4)) == (
        "found mug, out of reach: 1.4 m from the nearest place I can stand; colour not checked"
    )


def test_what_an_image_may_show_of_an_object_is_described():
    attributes = (
        Attribute(kind="colour", value="red"),
        Attribute(kind="owner", value="Anna"),
        Attribute(kind="feature", value="with a dinosaur on it"),
        Attribute(kind="condition", value="broken", negated=True),
    )
    goal = Goal(goal_id=1, object="mug", display="red mug", attributes=attributes)
    assert goal.described == "red mug, with a dinosaur on it, not broken"
    named = Goal(goal_id=1, object="teddy_bear", display="Rosie", thing_id=3)
    assert named.described == "teddy bear"
