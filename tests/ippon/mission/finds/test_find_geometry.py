import dataclasses

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import base_pose
from ippon.mission.finds.find_geometry import (
    FIND_WITHIN_M,
    ExclusionConfig,
    distance_m,
    exclusion_of_itself,
    exclusion_sphere,
    exhausted_text,
    find_from,
    looked_at,
    nearest_find,
    reached_find,
)
from ippon.mission.snapshot import Find
from ippon.robot import ZED

CAMERA = PinholeCamera.from_horizontal_fov(30, 18, 1.2)
HERE = base_pose(1.0, 2.0, 0.0, 0.0)


def find(x, voxels, box_px=None, size_m=(0.2, 0.2, 0.2)):
    return Find(
        position_world=(x, 2.0, 0.5),
        size_m=size_m,
        probability=0.9,
        voxels=voxels,
        box_px=box_px,
    )


@pytest.mark.parametrize(("away_m", "told"), [(0.95, None), (1.4, 1.4), (4.0, 4.0)])
def test_what_no_way_leads_within_a_metre_of_is_out_of_reach(away_m, told):
    found = find_from([find(away_m, 5, (0, 0, 3, 3))], HERE, away_m)
    assert found.out_of_reach_m == told
    assert find_from([find(9.0, 50)], HERE, 1.4) is None


def test_the_largest_in_view_of_those_near():
    seen, hidden, far = find(2.0, 5, (0, 0, 3, 3)), find(1.5, 50), find(9.0, 500, (0, 0, 3, 3))
    assert distance_m(HERE, far) == pytest.approx(8.0)
    assert nearest_find([hidden, seen, far], HERE) is seen
    assert nearest_find([hidden, far], HERE) is hidden
    assert nearest_find([far], HERE) is None


def test_what_is_in_reach_goes_before_what_is_larger_behind_it():
    stool, chair = find(2.0, 20, (0, 0, 3, 3)), find(2.7, 30, (0, 0, 3, 3))
    assert reached_find([chair, stool], HERE) is stool
    assert nearest_find([chair, stool], HERE) is chair
    long = find(2.7, 30, (0, 0, 3, 3), size_m=(1.4, 0.4, 0.5))
    assert reached_find([long, stool], HERE) is long, "its end is in reach"
    counter = find(4.0, 90, (0, 0, 3, 3), size_m=(4.2, 0.6, 0.9))
    assert nearest_find([counter], HERE) is None
    assert reached_find([counter, stool], HERE) is counter, "however far its middle is"
    unseen = find(2.0, 20)
    assert reached_find([chair, unseen], HERE) is None


@pytest.mark.parametrize(
    ("depth", "away"), [(1.5, 1.5), (9.0, FIND_WITHIN_M), (0.0, 0.5 * FIND_WITHIN_M)]
)
def test_what_is_looked_at_is_in_the_middle_of_the_image(depth, away):
    T_world_camera = HERE @ ZED.T_base_camera(0.0)
    frame = Frame(
        stamp_ns=0,
        color=np.zeros((18, 30, 3), np.uint8),
        depth=np.full((18, 30), depth, np.float32),
        camera=CAMERA,
        T_world_camera=T_world_camera,
        T_world_base=HERE,
        tilt_rad=0.0,
        heatmap=None,
        contact=False,
    )
    centre = T_world_camera[:3, 3]
    assert looked_at(frame) == pytest.approx(centre + np.array([away, 0.0, 0.0]))
    frame = dataclasses.replace(frame, depth=np.full((18, 30), np.nan, np.float32))
    assert looked_at(frame) == pytest.approx(centre + np.array([0.5 * FIND_WITHIN_M, 0.0, 0.0]))


def test_a_search_that_found_nothing_says_what_it_could_not_get_to():
    plain = "hat not found: everything reachable was seen"
    assert exhausted_text("hat", ()) == plain
    text = exhausted_text("hat", (find(3.0, 9), find(1.0, 2)))
    assert text == f"{plain}; no path leads close to the most likely candidate, at (3.0, 2.0) m"
    assert exhausted_text(
        "hats", (), found=1, wanted=3
    ) == "hats: 1 of 3 found" + plain.removeprefix("hat not found")
    assert exhausted_text("hats", (), full=True, found=1, wanted="all").startswith(
        "hats: 1 found: "
    )


def test_a_region_that_excludes_nothing_is_refused():
    with pytest.raises(ValueError, match="image_radius_m above 0; got"):
        ExclusionConfig(image_radius_m=0.0)


def test_the_excluded_region_extends_around_the_find():
    region = exclusion_sphere(ExclusionConfig(), find(1.0, 40, size_m=(0.6, 0.8, 0.0)))
    assert region.radius_m == pytest.approx(0.5 + ExclusionConfig().margin_m)
    assert region.centre_world == pytest.approx((1.0, 2.0, 0.5))


@pytest.mark.parametrize(
    ("x", "size_m", "longest_m", "continues"),
    [
        (0.8, (0.6, 0.6, 0.6), 1.0, True),
        (1.1, (0.6, 0.6, 0.6), 1.0, False),
        (1.1, (0.6, 0.6, 0.6), 2.0, True),
        (1.5, (0.6, 0.6, 0.6), 9.0, False),
        (1.1, (3.0, 0.2, 0.2), 2.0, False),
        (0.2, (3.0, 0.2, 0.2), 2.0, True),
    ],
    ids=["in it", "beside it", "rest of it", "apart", "longer than it", "larger than it"],
)
def test_a_find_continues_the_excluded_one_if_both_are_one_object(x, size_m, longest_m, continues):
    # The sphere's radius is 0.72 m and its margin 0.2 m.
    region = exclusion_sphere(ExclusionConfig(), find(0.0, 40, size_m=(0.6, 0.6, 0.6)))
    assert region.is_continued_by(find(x, 20, size_m=size_m), longest_m) is continues


@pytest.mark.parametrize("size_m", [(0.5, 0.5, 0.9), (0.1, 0.1, 0.1), (2.0, 0.9, 0.8)])
def test_a_find_alone_is_covered_by_balls_that_reach_little_farther(size_m):
    region = exclusion_of_itself(find(0.0, 40, size_m=size_m), 0.1)
    rng = np.random.default_rng(1)
    inside = region.centre_world + (rng.random((500, 3)) - 0.5) * size_m
    away = np.array([np.linalg.norm(inside - centre, axis=1) for centre, _ in region.balls])
    radii = np.array([[radius_m] for _, radius_m in region.balls])
    assert (away <= radii - 0.1 + 1e-9).any(axis=0).all()
    reach_m = max(centre[1] + radius_m for centre, radius_m in region.balls)
    assert reach_m - region.centre_world[1] - 0.5 * size_m[1] < 0.45


@pytest.mark.parametrize("size_m", [(3.0, 2.0, 0.05), (8.0, 6.0, 0.0), (1.0, 0.05, 0.7)])
def test_few_balls_cover_a_flat_find(size_m):
    region = exclusion_of_itself(find(0.0, 40, size_m=size_m), 0.05)
    assert 1 < len(region.balls) <= 16
