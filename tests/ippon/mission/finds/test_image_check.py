"""Before a search ends the images are asked whether they show the object, too."""

import dataclasses
import math

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform
from ippon.mission.behaviors.config import ExhaustionConfig
from ippon.mission.config import MissionConfig
from ippon.mission.finds.image_check import ImageCheck, ImageCheckConfig, votes
from ippon.mission.snapshot import Find, MissionState
from ippon.observation import Heatmap
from ippon.observation_model import (
    NOT_RECOGNISED,
    NOTHING_SAID,
    ObservationModel,
    ObservationModels,
    ScoreTable,
)

CAMERA = PinholeCamera.from_horizontal_fov(64, 48, 1.2)
LABELS = ("wall", "chair")
CONFIG = ImageCheckConfig()
AT = (2.0, 0.0, 1.0)
"""Right ahead of the camera."""


def frame(share: float, *, ooi: str = "hat", depth: float = 2.0, heatmap: bool = True) -> Frame:
    """An image whose upper part, a share of its rows, is taken for the object."""
    probabilities = np.zeros((48, 64, 3), np.uint8)
    probabilities[..., 0] = 255
    probabilities[: round(48 * share)] = (55, 0, 200)
    return Frame(
        stamp_ns=0,
        color=np.zeros((48, 64, 3), np.uint8),
        depth=np.full((48, 64), depth, np.float32),
        camera=CAMERA,
        T_world_camera=make_transform(R_BASE_CAMERA_LEVEL, (0.0, 0.0, 1.0)),
        T_world_base=make_transform(np.eye(3), (0.0, 0.0, 0.0)),
        tilt_rad=0.0,
        heatmap=Heatmap(labels=LABELS, ooi=ooi, probabilities=probabilities) if heatmap else None,
    )


def voxels() -> np.ndarray:
    """A wall of voxels round `AT` that the whole height of the image shows."""
    y, z = np.meshgrid(np.arange(-0.3, 0.31, 0.1), np.arange(0.1, 1.91, 0.1))
    return np.stack([np.full(y.size, 2.0), y.ravel(), z.ravel()], axis=1)


def find_of(centres: np.ndarray) -> Find:
    low, high = centres.min(axis=0) - 0.05, centres.max(axis=0) + 0.05
    return Find(
        position_world=tuple(centres.mean(axis=0).tolist()),
        size_m=tuple((high - low).tolist()),
        probability=1.0,
        voxels=len(centres),
        box_px=None,
    )


def after(shares, *, small=False, config=CONFIG, **options) -> tuple[ImageCheck, Find]:
    look, centres = ImageCheck(config, "hat", outline_voxels=math.inf if small else 0.0), voxels()
    find = find_of(centres)
    for share in shares:
        look.observe(frame(share, **options), centres, [find])
    return look, find


def test_what_the_image_shows_votes_and_what_it_hides_does_not():
    centres = np.array([AT, (2.0, 0.0, 1.6), (3.0, 0.0, 1.0), (-1.0, 0.0, 1.0), (2.0, 5.0, 1.0)])
    seen, wins = votes(frame(0.4), "hat", centres, ObservationModels(), 0.2)
    assert seen.tolist() == [True, True, False, False, False], "behind, at the back, beside"
    assert wins.tolist() == [False, True, False, False, False]


@pytest.mark.parametrize(
    ("score", "seen", "wins"),
    [(NOT_RECOGNISED, True, False), (NOTHING_SAID, False, False), (60, True, False),
     (110, True, True)],
)  # fmt: skip
def test_a_score_that_speaks_for_the_object_looks_like_it(score, seen, wins):
    image = frame(0.0)
    probabilities = np.zeros((48, 64, 3), np.uint8)
    # Another label's higher score does not count against the object's own.
    probabilities[...] = (200, 0, score)
    heatmap = Heatmap(labels=LABELS, ooi="hat", probabilities=probabilities, kind="scores")
    shown = dataclasses.replace(image, heatmap=heatmap)
    assert [v.tolist() for v in votes(shown, "hat", np.array([AT]), ObservationModels(), 0.2)] == [
        [seen],
        [wins],
    ]
    strict = ObservationModel(
        source="any scores",
        kind="scores",
        provenance="a test",
        table=ScoreTable(scores=(0.5, 0.9), nats=(-1.0, 5.0)),
    )
    assert not votes(shown, "hat", np.array([AT]), ObservationModels([strict]), 0.2)[1].any()


@pytest.mark.parametrize(
    ("share", "small", "against"),
    [(0.9, False, False), (0.6, False, False), (0.3, False, True), (0.4, True, False),
     (0.2, True, True)],
)  # fmt: skip
def test_the_images_decide_by_their_average(share, small, against):
    look, find = after([share] * 10, small=small)
    assert look.share(find) == pytest.approx(share, abs=0.08)
    assert look.contradicts(find) is against


@pytest.mark.parametrize(
    ("share", "probability", "small", "against"),
    [(0.5, 0.97, False, True), (0.5, 0.995, False, False), (0.8, 0.97, False, False),
     (0.5, 0.97, True, False)],
)  # fmt: skip
def test_a_find_that_the_map_is_not_sure_of_must_look_like_it_more_often(
    share, probability, small, against
):
    look, find = after([share] * 10, small=small, config=ImageCheckConfig(unsure_share=0.6))
    unsure = dataclasses.replace(find, probability=probability)
    assert look.contradicts(unsure) is against


def test_a_find_with_few_images_has_no_score():
    look, find = after([0.0] * 7)
    assert look.share(find) is None
    assert not look.contradicts(find)


def test_the_last_images_count():
    look, find = after([0.0] * 40 + [1.0] * 40)
    assert look.share(find) == pytest.approx(1.0)


@pytest.mark.parametrize("options", [{"ooi": "cap"}, {"heatmap": False}, {"depth": 1.0}])
def test_an_image_of_something_else_or_of_nothing_says_nothing(options):
    look, find = after([0.0] * 20, **options)
    assert look.share(find) is None


def test_a_heatmap_that_comes_late_is_asked_too(searcher, room):
    bed = ("bed", "bed", (3.6, 1.2, 0.0), (5.4, 3.0, 0.55))
    robot = searcher([*room(8.0, 4.5), bed], 1.0, 2.0)
    robot.ask("bed")
    asked = []
    robot.search(30.0, until=lambda result: bool(result.snapshot.candidates))
    robot.mission.search.image_check.observe = lambda frame, *_: asked.append(frame.heatmap)
    frame = robot.world.observe()
    robot.mission.observe(dataclasses.replace(frame, heatmap=None))
    robot.mission.learn(frame)
    assert asked == [None, frame.heatmap]


def test_it_is_known_which_image_showed_a_find_last():
    look, find = after([0.9] * 5)
    assert (look.images, look.last_image_of(find)) == (5, 5)
    beyond = dataclasses.replace(find, position_world=(5.0, 3.0, 1.0))
    assert look.last_image_of(beyond) == 0
    look.observe(frame(0.9, depth=0.5), voxels(), [find])
    assert (look.images, look.last_image_of(find)) == (6, 5)


def test_another_find_has_its_own_images():
    look, find = after([0.0] * 20)
    elsewhere = dataclasses.replace(find, position_world=(5.0, 3.0, 1.0))
    assert look.contradicts(find)
    assert not look.contradicts(elsewhere)


@pytest.mark.parametrize(
    "wrong",
    [
        {"least_share": 1.1},
        {"least_share_small": -0.1},
        {"elsewhere_share": 1.1},
        {"unsure_share": 1.5},
        {"sure": -1.0},
        {"reconsidered_share": 1.01},
        {"min_images": 0},
        {"images": 5},
    ],
)
def test_a_config_without_meaning_is_refused(wrong):
    with pytest.raises(ValueError, match="must lie in"):
        ImageCheckConfig(**wrong)


def test_a_check_that_tracks_nothing_is_refused():
    with pytest.raises(ValueError, match="max_tracks must be at least 1"):
        ImageCheckConfig(max_tracks=0)
    with pytest.raises(ValueError, match="same_m and depth_tolerance_m above 0"):
        ImageCheckConfig(depth_tolerance_m=0.0)


@pytest.fixture
def doubter(searcher, room):
    """Ask for a bed that never looks enough like one; returns robot, results and events."""
    bed = ("bed", "bed", (3.0, 1.2, 0.0), (4.8, 3.0, 0.55))

    def search(seconds, exhaustion=None, **doubts):
        # At outlines pixels mix: no find looks like itself in all of its voxels.
        doubt = ImageCheckConfig(least_share=1.0, min_images=1, **doubts)
        config = MissionConfig(image_check=doubt, exhaustion=exhaustion or ExhaustionConfig())
        robot = searcher([*room(6.4, 4.2), bed], 1.0, 2.0, config=config)
        robot.ask("bed")
        results = robot.search(seconds)
        return robot, results, [event for r in results for event in r.snapshot.events]

    return search


@pytest.mark.slow
@pytest.mark.parametrize("idle_gain", [0.0, 0.15])
def test_a_doubted_find_is_reconsidered_when_no_better_one_is_left(doubter, idle_gain):
    robot, _, events = doubter(200.0, ExhaustionConfig(idle_gain=idle_gain))
    kinds = [event.kind for event in events]
    assert kinds.count("doubted") == kinds.count("reconsidered") == 1
    assert kinds.index("doubted") < kinds.index("reconsidered") < kinds.index("found")
    assert "perhaps: nothing looks more like it" in robot.last.why
    assert "exhausted" not in kinds


@pytest.mark.slow
def test_a_search_continues_after_a_doubted_find_and_a_second_doubt_is_final(doubter):
    robot, results, events = doubter(200.0, reconsidered_share=1.0)
    kinds = [event.kind for event in events]
    assert (kinds.count("doubted"), kinds.count("reconsidered")) == (2, 1)
    assert "hardly looks like it" in events[kinds.index("doubted")].text
    assert MissionState.FOUND not in [r.snapshot.state for r in results]
    assert kinds[-1] == "exhausted"
    assert robot.last.candidates == (), "it is ruled out"


@pytest.mark.slow
@pytest.mark.parametrize(("enough", "waits"), [(1, False), (40, True)])
def test_a_find_that_few_images_have_shown_is_looked_at_first(searcher, room, enough, waits):
    bed = ("bed", "bed", (2.4, 1.2, 0.0), (4.2, 3.0, 0.55))
    config = MissionConfig(image_check=ImageCheckConfig(min_images=enough))
    robot = searcher([*room(8.0, 4.5), bed], 1.0, 2.0, config=config)
    robot.ask("bed")
    results = robot.search(60.0)
    looking = [r for r in results if r.snapshot.why == "checking whether that is bed"]
    assert bool(looking) is waits
    assert len(looking) <= enough
    assert robot.last.state is MissionState.FOUND


@pytest.mark.slow
@pytest.mark.parametrize(("wait_s", "is_checked"), [(90.0, True), (10.0, False)])
def test_images_of_a_slow_network_are_waited_for(searcher, room, wait_s, is_checked):
    bed = ("bed", "bed", (2.4, 1.2, 0.0), (4.2, 3.0, 0.55))
    config = MissionConfig(image_check=ImageCheckConfig(wait_s=wait_s))
    robot = searcher([*room(8.0, 4.5), bed], 1.0, 2.0, config=config)
    mission, taken = robot.mission, []

    def step(frame: Frame):
        """Only every tenth heatmap arrives, and late."""
        mission.observe(dataclasses.replace(frame, heatmap=None))
        taken.append(frame)
        if len(taken) % 10 == 0:
            mission.learn(taken[-5])
        return mission.decide(dataclasses.replace(frame, heatmap=None))

    mission.step = step
    robot.ask("bed")
    robot.search(150.0)
    assert robot.last.state is MissionState.FOUND
    assert (mission.search.image_check.share(robot.last.find) is not None) is is_checked
    assert ("not checked: too few images show it" in robot.last.why) is not is_checked


@pytest.mark.parametrize(("outline_voxels", "against"), [(133, False), (132, True)])
def test_a_small_thing_that_fills_many_voxels_is_no_mere_outline(outline_voxels, against):
    look = ImageCheck(CONFIG, "hat", outline_voxels=outline_voxels)
    find = find_of(voxels())
    assert find.voxels == 133
    for _ in range(10):
        look.observe(frame(0.4), voxels(), [find])
    assert look.contradicts(find) is against


@pytest.mark.slow
@pytest.mark.parametrize(("single_voxel_share", "state"), [(0.5, "found"), (2.0, "exhausted")])
def test_a_small_thing_that_fills_one_voxel_is_found_in_front_of_the_robot(
    searcher, room, single_voxel_share, state
):
    table = ("table", "table", (3.0, 1.5, 0.0), (3.6, 2.3, 0.7))
    mug = ("mug", "objects", (3.02, 1.92, 0.7), (3.08, 1.98, 0.76))
    config = MissionConfig(image_check=ImageCheckConfig(single_voxel_share=single_voxel_share))
    robot = searcher([*room(5.0, 4.0), table, mug], 1.0, 2.0, config=config)
    robot.ask("mug")
    robot.search(150.0)
    assert robot.last.state.value == state
    assert [c.voxels for c in robot.last.candidates] == [1]
    if state == "found":
        assert np.hypot(*(robot.at - np.array(robot.last.find.position_world[:2]))) < 1.0
        assert robot.mission.goals.reject_find()
        planner, search = robot.mission._planner, robot.mission.search
        assert planner._termination_min == search.termination_min == 1.0, "as before"


@pytest.mark.parametrize(("near", "against"), [(0.9, False), (0.3, True)])
def test_what_looks_like_the_object_from_nearby_is_not_denied_for_how_it_looked_from_afar(
    near, against
):
    look, find = after([0.2] * 30 + [near] * CONFIG.min_images)
    assert look.share(find) < CONFIG.least_share
    assert look.contradicts(find) is against
    look, find = after([0.2] * 30 + [near] * (CONFIG.min_images // 2))
    assert look.contradicts(find), "half as many are too few"


def test_the_last_images_alone_do_not_save_a_find():
    last = CONFIG.min_images
    look, find = after([0.2] * 40 + [0.5] * last)
    assert look.contradicts(find), "0.26 in all, 0.5 in the last"
    look, find = after([0.6] * 40 + [0.1] * last)
    assert not look.contradicts(find), "nor do they speak against one"


def recognised(part: float, score: int = 120) -> Frame:
    """An image of a detector that recognises the object in the upper part of its rows."""
    probabilities = np.zeros((48, 64, 3), np.uint8)
    probabilities[: round(48 * part), :, 2] = score
    heatmap = Heatmap(labels=LABELS, ooi="hat", probabilities=probabilities, kind="scores")
    return dataclasses.replace(frame(0.0), heatmap=heatmap)


def detected(parts, *, small=False) -> tuple[ImageCheck, Find]:
    look, centres = ImageCheck(CONFIG, "hat", outline_voxels=math.inf if small else 0.0), voxels()
    find = find_of(centres)
    for part in parts:
        look.observe(recognised(part), centres, [find])
    return look, find


@pytest.mark.parametrize("small", [False, True])
def test_a_detector_that_recognises_a_part_of_a_find_in_every_image_confirms_it(small):
    look, find = detected([0.2] * 10, small=small)
    assert look.share(find) == 1.0
    assert not look.contradicts(find)
    look, find = detected([0.0] * 10, small=small)
    assert look.share(find) == 0.0
    assert look.contradicts(find)


def test_a_small_find_is_recognised_by_a_detector_as_often_as_others():
    images = [1.0, 0.0, 0.0, 1.0, 0.0] * 4
    look, find = detected(images, small=True)
    assert CONFIG.least_share_small < look.share(find) < CONFIG.least_share
    assert look.contradicts(find), "its outline does not matter"


def test_what_a_detector_misses_from_nearby_is_denied_however_it_looked_from_afar():
    look, find = detected([1.0] * 20 + [0.0] * CONFIG.min_images)
    assert look.share(find) > CONFIG.least_share
    assert look.contradicts(find)
    look, find = detected([1.0] * 20 + [0.0, 1.0] * (CONFIG.min_images // 2))
    assert not look.contradicts(find), "half of the last ones are enough"


def test_votes_of_a_detector_and_of_labelled_pixels_are_not_mixed():
    look, find = detected([0.0] * 20)
    for _ in range(CONFIG.min_images - 1):
        look.observe(frame(0.9), voxels(), [find])
    assert look.share(find) is None
    look.observe(frame(0.9), voxels(), [find])
    assert look.share(find) == pytest.approx(0.9, abs=0.05)


def test_one_of_several_objects_is_read_from_its_own_channel():
    shown = frame(0.4, ooi="mug")
    p = np.concatenate([shown.heatmap.probabilities, np.zeros((48, 64, 1), np.uint8)], axis=2)
    heatmap = Heatmap(labels=(*LABELS, "hat"), ooi="mug", probabilities=p)
    several = dataclasses.replace(shown, heatmap=heatmap)
    centres = np.array([(2.0, 0.0, 1.6)])
    for label, wins in (("hat", True), ("mug", False)):
        seen, won = votes(several, label, centres, ObservationModels(), 0.2)
        assert (seen.tolist(), won.tolist()) == ([True], [wins])
    assert not votes(several, "keys", centres, ObservationModels(), 0.2)[0].any()
