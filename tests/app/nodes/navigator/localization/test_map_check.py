"""A map of yesterday, in the frame of today or in another one."""

import dataclasses
import math

import pytest

from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.localization import map_check
from app.nodes.navigator.localization.alignment import in_map_frame
from app.nodes.navigator.localization.map_check import MapCheck
from ippon.geometry import make_transform, rotation_z
from ippon.mapping.config import MapConfig
from ippon.mapping.voxel_map import VoxelMap
from ippon.mission.config import MissionConfig
from ippon.robot import ZED
from ippon.simulation.robot.mobile_base import camera_of
from ippon.simulation.scene import StartPose
from ippon.simulation.world import SimulatedWorld, WorldConfig
from ippon.vocabulary import MATTERPORT_40
from tests.boxes import boxes_scene

MAP = MapConfig(memory_limit_mb=128.0)
HOME = [
    ("floor", "floor", (-0.1, -0.1, -0.1), (12.1, 4.1, 0.0)),
    ("wall", "wall", (-0.1, -0.1, 0.0), (0.0, 4.1, 2.5)),
    ("wall", "wall", (12.0, -0.1, 0.0), (12.1, 4.1, 2.5)),
    ("wall", "wall", (0.0, -0.1, 0.0), (12.0, 0.0, 2.5)),
    ("wall", "wall", (0.0, 4.0, 0.0), (12.0, 4.1, 2.5)),
    ("wall", "wall", (5.9, 1.2, 0.0), (6.0, 4.0, 2.5)),
    ("cabinet", "cabinet", (0.0, 3.2, 0.0), (1.5, 4.0, 2.0)),
    ("sofa", "sofa", (4.8, 0.2, 0.0), (5.8, 2.2, 0.7)),
]
KEPT = {"home.map": b"map", "home.map.memory": b"things", "home.map.rooms.json": b"[]"}
SHIFTED = make_transform(rotation_z(0.8), (0.5, 0.2, 0.0))


def seen_from(x, y, yaw):
    start = StartPose(x=x, y=y, z=0.0, yaw=yaw)
    world = SimulatedWorld(
        boxes_scene(HOME), ZED, camera_of(ZED, 128), start, 1, WorldConfig.perfect()
    )
    world.set_labels(MATTERPORT_40, MATTERPORT_40[0])
    return world.observe()


@pytest.fixture(scope="module")
def yesterday():
    """The map of the western room."""
    voxel_map = VoxelMap(MAP, MATTERPORT_40)
    for k in range(16):
        x, y = ((1.0, 1.0), (3.0, 2.0))[k % 2]
        frame = seen_from(x, y, k * math.pi / 8.0)
        voxel_map.integrate(dataclasses.replace(frame, stamp_ns=(k + 1) * 100_000_000_000))
    return voxel_map


@pytest.fixture
def kept(tmp_path):
    for name, content in KEPT.items():
        (tmp_path / name).write_bytes(content)
    return tmp_path


@pytest.fixture
def check_of(kept):
    def make(voxel_map, **profile):
        config = NavigatorConfig(
            robot="r", mission=MissionConfig(map=MAP), keep_map=str(kept / "home.map"),
            profile=dataclasses.replace(ZED, **profile),
        )  # fmt: skip
        check = MapCheck(voxel_map, lambda *event: check.events.append(event), config)
        check.events = []
        return check

    return make


def test_an_image_that_agrees_confirms_the_map_at_once(yesterday, check_of, kept):
    check = check_of(yesterday)
    assert check.waits()
    assert not check.check(seen_from(2.2, 1.6, 0.4))
    assert (check.waits(), check.note, check.events) == (False, "", [])
    assert len(list(kept.iterdir())) == len(KEPT)
    none = check_of(None)
    assert (none.waits(), none.check(seen_from(2.2, 1.6, 0.4))) == (False, False)


def test_an_image_that_contradicts_the_map_is_reported_once_and_the_map_copied(
    yesterday, check_of, kept
):
    frame = in_map_frame(seen_from(2.2, 1.6, 0.4), SHIFTED)
    check = check_of(yesterday)
    assert check.check(frame)
    assert not check.check(frame)
    assert check.problem.endswith(
        "of it contradicts the map; the robot's frame has changed: the map as it was is kept as "
        "home.map.aside-1; start again with --align and that --map"
    )
    assert check.note == check.problem
    assert check.events == [("error", check.problem)]
    for name, content in KEPT.items():
        copy = name.replace("home.map", "home.map.aside-1")
        assert (kept / copy).read_bytes() == (kept / name).read_bytes() == content
    problem = check.problem
    assert not check.check(frame, held=False)
    assert (check.problem, check.note) == ("", problem), "Resume has answered it"
    follower = check_of(yesterday, takes_velocities=False)
    assert follower.check(frame)
    assert follower.problem.endswith("home.map.aside-2; start again with another --map")
    (kept / "home.map").unlink()
    last = check_of(yesterday)
    last.check(frame)
    assert last.problem.endswith("could not be kept (No such file or directory)")


@pytest.mark.parametrize("is_shifted", [False, True], ids=["the same frame", "another frame"])
def test_a_robot_that_begins_in_unmapped_space_is_checked_once_it_sees_the_map(
    yesterday, check_of, is_shifted
):
    """Until then nothing is overwritten, and the operator is told."""
    T = make_transform(rotation_z(0.3), (0.0, 0.5, 0.0)) if is_shifted else None
    check = check_of(yesterday)
    for k in range(4):
        assert not check.check(in_map_frame(seen_from(9.0, 2.0, 0.3 * (k - 2)), T))
    assert check.waits()
    assert check.note.startswith("the kept map is not confirmed yet: too little of it has been")
    # It turns, and drives through the door.
    found = [check.check(in_map_frame(seen_from(x, 0.6, math.pi), T)) for x in (8.0, 6.5, 5.0, 4.0)]
    assert not check.waits()
    assert any(found) == is_shifted
    assert check.note == check.problem


def test_a_robot_that_never_sees_the_map_goes_on_with_a_copy_of_it(
    yesterday, check_of, kept, monkeypatch
):
    monkeypatch.setattr(map_check, "MOST_VIEWS", 3)
    check = check_of(yesterday)
    for k in range(5):
        assert not check.check(seen_from(9.0, 2.0, 0.3 * (k - 2)))
    assert (check.waits(), check.problem) == (False, "")
    assert check.note.startswith(
        "the kept map was not confirmed: too little of it was in view of 3"
    )
    assert check.events == [("memory", check.note)]
    assert (kept / "home.map.aside-1").exists()
