"""What images show beyond the map's range, and where they put it."""

import math
from dataclasses import replace

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import make_transform, rotation_z
from ippon.mapping.far_evidence.far_evidence import FarEvidence, FarEvidenceConfig
from ippon.observation import Heatmap
from ippon.robot import ZED

CAMERA = PinholeCamera.from_horizontal_fov(160, 100, math.radians(74.0))
NEAR_M = 4.0
HEADINGS = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
FAR = np.full((1, 24), 5.0, np.float32)


def frame_of(
    pixels, *, depth=0.0, p=0.9, at=(0.0, 0.0), yaw=0.0, ooi="hat", every=0.0, stamp_s=0.0
):
    """A frame whose heatmap shows the object in some pixels (rows, columns of the image)."""
    T_world_base = make_transform(rotation_z(yaw), (*at, 0.0))
    heat = np.zeros((100, 160, 2), np.uint8)
    heat[..., 1] = round(255 * every)
    heat[(*pixels, 1)] = round(255 * p)
    heat[..., 0] = 255 - heat[..., 1]
    labels = ("wall",) if ooi != "wall" else ("wall", "floor")
    return Frame(
        stamp_ns=round(stamp_s * 1e9),
        color=np.zeros((100, 160, 3), np.uint8),
        depth=np.broadcast_to(np.float32(depth), (100, 160)).astype(np.float32),
        camera=CAMERA,
        T_world_camera=T_world_base @ ZED.T_base_camera(0.0),
        T_world_base=T_world_base,
        tilt_rad=0.0,
        heatmap=Heatmap(labels=labels, ooi=ooi, probabilities=heat),
    )


def rows_at(distance_m, height_m=0.0, spread=4):
    """The image row that shows a height over the floor at a distance ahead, and some above."""
    v = CAMERA.cy + CAMERA.fy * (ZED.camera_height_m - height_m) / distance_m
    return slice(round(v) - spread, round(v) + 1)


AHEAD = (rows_at(7.0), slice(76, 84))


FROM_AFAR = FarEvidenceConfig()
"""What images show from afar, alone."""


def made(images, config=FROM_AFAR):
    far_evidence = FarEvidence(config, "hat", NEAR_M)
    for image in images:
        far_evidence.integrate(image)
    return far_evidence


def seen_from(far_evidence, x, y):
    return far_evidence.ahead(np.array([[x, y]]), HEADINGS, FAR)[0]


def shown(far_evidence):
    return len(far_evidence.places()) if far_evidence.revision else 0


def test_a_distant_object_raises_the_viewpoints_that_look_at_it():
    far_evidence = made([frame_of(AHEAD)] * 8)
    ahead = seen_from(far_evidence, 2.0, 0.0)
    assert ahead[0] > 2.0
    assert (ahead[6:19] == 0.0).all(), "to the sides and behind there is nothing"
    assert (seen_from(far_evidence, -3.0, 0.0) == 0.0).all(), "from here it is still too far"


def test_where_it_meets_the_floor_bounds_how_far_it_is():
    far_evidence = made([frame_of(AHEAD)] * 8)
    assert seen_from(far_evidence, 6.0, 0.0)[0] > 2.0
    beyond = 7.0 + FarEvidenceConfig().spread_m + 1.0
    assert seen_from(far_evidence, beyond, 0.0)[0] == 0.0
    # What may stand on a table is bounded by the reach alone.
    level = (rows_at(7.0, height_m=1.2), slice(76, 84))
    assert seen_from(made([frame_of(level)] * 8), 8.5, 0.0)[0] > 2.0


def test_far_depth_says_where_it_is():
    far_evidence = made([frame_of((rows_at(7.0, 1.2), slice(76, 84)), depth=7.0)] * 8)
    at = np.array([[x, 0.0] for x in (3.0, 6.0, 9.5)])
    ahead = far_evidence.ahead(at, HEADINGS[:1], np.full((3, 1), 1.0, np.float32))[:, 0]
    assert ahead[1] > 2.0
    assert ahead[0] == ahead[2] == 0.0


def test_cells_within_the_maps_range_are_left_to_the_map():
    assert shown(made([frame_of(AHEAD, depth=2.0)] * 20)) == 0
    far_evidence = made([frame_of(AHEAD)] * 8)
    assert seen_from(far_evidence, 4.0, 0.0)[0] > 2.0
    for x in (2.0, 3.0, 4.5) * 3:
        far_evidence.integrate(frame_of(AHEAD, depth=3.9, at=(x, 0.0)))
    assert seen_from(far_evidence, 4.0, 0.0)[0] == 0.0
    for _ in range(8):
        far_evidence.integrate(frame_of(AHEAD))
    assert seen_from(far_evidence, 4.0, 0.0)[0] == 0.0, "and stays so, from afar, too"


def test_a_place_behind_something_near_was_not_looked_at():
    far_evidence = made([frame_of(AHEAD)] * 8)
    for _ in range(5):
        far_evidence.integrate(frame_of(AHEAD, depth=0.5, at=(5.0, 0.0)))
    assert seen_from(far_evidence, 4.5, 0.0)[0] > 2.0


def test_images_of_one_thing_are_no_independent_witnesses():
    few, many = made([frame_of(AHEAD, p=0.2)] * 8), made([frame_of(AHEAD, p=0.2)] * 200)
    once, often = seen_from(few, 4.0, 0.0)[0], seen_from(many, 4.0, 0.0)[0]
    assert 0.5 < once <= often < once + 0.3
    sure = seen_from(made([frame_of(AHEAD, p=1.0)] * 200), 4.0, 0.0)[0]
    config = FarEvidenceConfig()
    assert sure == pytest.approx(config.most_nat - config.least_nat, abs=0.05)


def test_images_that_show_it_no_more_take_it_back():
    far_evidence = made([frame_of(AHEAD)] * 8)
    for _ in range(8):
        far_evidence.integrate(frame_of(AHEAD, p=0.0))
    assert seen_from(far_evidence, 4.0, 0.0)[0] == 0.0


def test_evidence_decays_without_new_images():
    far_evidence = made([frame_of(AHEAD)] * 8)
    before = far_evidence.places()
    elsewhere = {"yaw": math.pi, "depth": 3.0}
    for k in range(1, 61):
        far_evidence.integrate(frame_of(AHEAD, stamp_s=k, **elsewhere))
    assert 0 < before[:, 2].max() < 4.01
    assert len(far_evidence.places()) == 0
    assert (seen_from(far_evidence, 4.0, 0.0) == 0.0).all()


def test_after_a_clock_reset_evidence_decays_with_time_only():
    far_evidence = made([frame_of(AHEAD, stamp_s=1e6)] * 8)
    far_evidence.integrate(frame_of(AHEAD, stamp_s=0.0))
    assert seen_from(far_evidence, 4.0, 0.0)[0] > 2.0
    for k in range(1, 61):
        far_evidence.integrate(frame_of(AHEAD, stamp_s=k, yaw=math.pi, depth=3.0))
    assert len(far_evidence.places()) == 0


def with_holes(depth_m, share):
    holes = np.random.default_rng(1).random((100, 160)) < share
    return np.where(holes, 0.0, depth_m)


def test_holes_in_near_surfaces_are_not_distant_views():
    assert shown(made([frame_of(AHEAD, depth=with_holes(2.0, 0.05))] * 20)) == 0


@pytest.mark.parametrize("depth", [with_holes(1.5, 0.03), 4.5], ids=["holes", "a wall beyond"])
def test_occluders_are_not_evidence_against_a_place(depth):
    far_evidence = made([frame_of(AHEAD)] * 8)
    before = far_evidence.places()
    hidden = before[before[:, 0] > 6.0]
    assert len(hidden)
    for _ in range(8):
        far_evidence.integrate(frame_of(AHEAD, p=0.0, depth=depth))
    left = {(x, y): nat for x, y, nat in far_evidence.places().tolist()}
    assert all(left.get((x, y), 0.0) >= nat for x, y, nat in hidden.tolist())


def test_images_without_depth_leave_nothing_to_the_map():
    far_evidence = made([frame_of(AHEAD)] * 8)
    for _ in range(5):
        far_evidence.integrate(frame_of(AHEAD, at=(4.0, 0.0)))
    assert seen_from(far_evidence, 4.0, 0.0)[0] > 2.0


@pytest.mark.parametrize(
    "image",
    [
        frame_of(AHEAD, ooi="wall"),
        frame_of(AHEAD, p=0.05, every=0.05),
    ],
    ids=["another object", "no more than elsewhere"],
)
def test_configurations_out_of_range_are_rejected(image):
    assert made([image] * 20).revision == 0


def test_places_are_the_same_until_they_change():
    far_evidence = made([frame_of(AHEAD)] * 8)
    places = far_evidence.places()
    assert len(places)
    revision = far_evidence.revision
    for n in range(12):
        far_evidence.integrate(frame_of(AHEAD, depth=3.0, at=(-8.0, 0.1 * n), yaw=math.pi))
    assert far_evidence.revision == revision
    assert far_evidence.places() is places


@pytest.mark.parametrize("code", [65.535, math.inf, math.nan, 0.0])
def test_a_sensors_code_for_no_return_leaves_cells_to_far_evidence(code):
    far_evidence = made([frame_of(AHEAD)] * 8)
    for _ in range(6):
        far_evidence.integrate(frame_of(AHEAD, depth=code, at=(4.0, 0.0)))
    assert seen_from(far_evidence, 4.0, 0.0)[0] > 2.0


def cued_from(far_evidence, x, y):
    return far_evidence.cued(np.array([[x, y]]), HEADINGS, FAR)[0]


def with_cues(labels, images, config=FROM_AFAR):
    far_evidence = FarEvidence(config, "cup", NEAR_M)
    far_evidence.set_cues(labels)
    for image in images:
        far_evidence.integrate(image)
    return far_evidence


def sofa_at(pixels, p=0.9, ooi="cup"):
    """A frame that shows a sofa in some pixels, and a cup nowhere."""
    heat = np.zeros((100, 160, 3), np.uint8)
    heat[(*pixels, 1)] = round(255 * p)
    heat[..., 0] = 255 - heat[..., 1]
    labels = ("wall", "sofa")
    return replace(frame_of(pixels), heatmap=Heatmap(labels=labels, ooi=ooi, probabilities=heat))


def test_an_object_of_level_certain_is_a_distant_cue():
    far_evidence = with_cues(("sofa", "bed"), [sofa_at(AHEAD)] * 8)
    assert far_evidence.cue_labels == ("sofa", "bed")
    cued = cued_from(far_evidence, 2.0, 0.0)
    assert cued[0]
    assert not cued[6:19].any()
    assert (seen_from(far_evidence, 2.0, 0.0) == 0.0).all(), "it is not the object"
    assert shown(far_evidence) == 0
    assert not cued_from(with_cues(("sofa",), [sofa_at(AHEAD, p=0.1)] * 8), 2.0, 0.0).any()
    assert not cued_from(with_cues(("bed",), [sofa_at(AHEAD)] * 8), 2.0, 0.0).any()


def test_changed_cues_are_reset_and_unchanged_ones_kept():
    far_evidence = with_cues(("sofa",), [sofa_at(AHEAD)] * 8)
    before = far_evidence.revision
    far_evidence.set_cues(["sofa"])
    assert far_evidence.revision == before
    assert cued_from(far_evidence, 2.0, 0.0)[0]
    far_evidence.set_cues([])
    assert far_evidence.revision > before, "viewpoints are weighed anew"
    assert not cued_from(far_evidence, 2.0, 0.0).any()
    far_evidence.set_cues(["cup"])
    assert far_evidence.cue_labels == (), "the object is not its own cue"


def test_cells_left_to_the_map_stay_so_when_cues_change():
    def search(looked):
        far_evidence = with_cues(
            (), [frame_of(AHEAD, p=0.0, depth=3.9, ooi="cup")] * 4 if looked else []
        )
        far_evidence.set_cues(("sofa",))
        for _ in range(8):
            far_evidence.integrate(replace(sofa_at(AHEAD), **pose(-1.5)))
        return cued_from(far_evidence, -1.0, 0.0)[0]

    assert search(looked=False)
    assert not search(looked=True)


def pose(x):
    frame = frame_of(AHEAD, at=(x, 0.0))
    return {"T_world_base": frame.T_world_base, "T_world_camera": frame.T_world_camera}


def test_the_faint_background_of_many_labels_is_no_cue():
    labels = tuple(f"thing {n}" for n in range(12))
    heat = np.full((100, 160, 13), 8, np.uint8)
    image = replace(frame_of(AHEAD), heatmap=Heatmap(labels=labels, ooi="cup", probabilities=heat))
    assert not cued_from(with_cues(labels, [image] * 8), 2.0, 0.0).any()


def test_switched_off_there_are_no_cues_either():
    off = replace(FROM_AFAR, enabled=False)
    assert not cued_from(with_cues(("sofa",), [sofa_at(AHEAD)] * 8, off), 2.0, 0.0).any()


def test_switched_off_nothing_is_remembered():
    assert made([frame_of(AHEAD)] * 8, replace(FROM_AFAR, enabled=False)).revision == 0


def test_there_is_no_evidence_beyond_the_grid():
    far_evidence = made([frame_of(AHEAD)] * 8)
    assert (seen_from(far_evidence, 1e4 + 4.0, 1e4) == 0.0).all()


@pytest.mark.parametrize(
    "change",
    [
        {"reach_m": 0.0},
        {"reach_m": 100.0},
        {"cell_m": math.inf},
        {"share": 0.0},
        {"images_near": 0},
        {"least_nat": 4.0},
        {"cue_nat": 4.0},
        {"forget_s": 0.0},
        {"spread_m": -0.1},
    ],
)
def test_numbers_without_meaning_are_refused(change):
    with pytest.raises(ValueError, match=next(iter(change))):
        FarEvidenceConfig(**change)


def moved(frame, x=0.0, z=0.0):
    """The frame of a robot elsewhere, with the same images."""
    shift = make_transform(np.eye(3), (x, 0.0, z))
    return replace(
        frame,
        T_world_camera=shift @ frame.T_world_camera,
        T_world_base=shift @ frame.T_world_base,
    )


NOWHERE = (slice(0, 0), slice(0, 0))


def test_each_floor_has_its_own_evidence():
    far_evidence = made([frame_of(AHEAD)] * 8)
    before = far_evidence.revision
    far_evidence.integrate(moved(frame_of(NOWHERE), z=3.0))
    assert far_evidence.revision > before
    assert (seen_from(far_evidence, 2.0, 0.0) == 0.0).all(), "that was on the floor below"
    assert len(far_evidence.places()) == 0


def test_floor_seen_from_near_is_left_to_the_map_on_its_floor_alone():
    drive = [frame_of(NOWHERE, depth=6.0, at=(x, 0.0)) for x in range(12) for _ in range(3)]
    far_evidence = made([*drive, *([frame_of(AHEAD)] * 8)])
    assert (seen_from(far_evidence, 2.0, 0.0) == 0.0).all()
    for _ in range(8):
        far_evidence.integrate(moved(frame_of(AHEAD), z=3.0))
    assert seen_from(far_evidence, 2.0, 0.0)[0] > 2.0


@pytest.mark.parametrize("away_m", [70.0, -70.0, 500.0])
def test_evidence_goes_along_with_a_robot_in_a_large_building(away_m):
    far_evidence = made([frame_of(NOWHERE), *([moved(frame_of(AHEAD), x=away_m)] * 8)])
    assert seen_from(far_evidence, away_m + 2.0, 0.0)[0] > 2.0


def test_evidence_keeps_its_place_when_the_grid_moves():
    still = made([moved(frame_of(AHEAD), x=50.0)] * 8)
    far_evidence = made([frame_of(NOWHERE), *([moved(frame_of(AHEAD), x=50.0)] * 8)])
    far_evidence.integrate(moved(frame_of(NOWHERE), x=56.0))
    for x in (51.0, 52.0, 53.0):
        expected = seen_from(still, x, 0.0)[0]
        assert seen_from(far_evidence, x, 0.0)[0] == pytest.approx(expected, abs=0.3)
