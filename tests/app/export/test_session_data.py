"""Data of a recording for exports."""

import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from app.datasets.bag_robot import BagRobot
from app.export.session_data import SessionData, read_session_data
from app.messages import keys
from app.messages.control import encode
from app.messages.memory import MapAlignment
from app.messages.motion import StampedTransform, encode_transforms
from app.recording.errors import RecordingError
from ippon.geometry import base_pose
from tests.app.messages.robot_messages import odometry
from tests.app.recording.conftest import alignment_at, write_session

STAMPS = (1_000_000_000, 2_000_000_000)


def session_of(messages, **options):
    def all_messages(wanted):
        return (one for one in messages if one.key in wanted)

    def topics(key):
        found = {getattr(one, "topic", key) for one in messages if one.key == key}
        return sorted(found)

    recording = SimpleNamespace(path=Path("a"), all_messages=all_messages, topics=topics)
    return SessionData(
        path=recording.path, recording=recording, timeline=None, scene=None, **options
    )


def tf(stamp_ns, parent, child, x=0.0):
    T = base_pose(x, 0.0, 0.0, 0.0)
    pose = StampedTransform(stamp_ns=stamp_ns, parent=parent, child=child, T_parent_child=T)
    return SimpleNamespace(key=keys.TF, payload=encode_transforms([pose]), time_ns=stamp_ns)


ODOMETRY = [
    SimpleNamespace(key=keys.ODOM, payload=odometry(stamp_ns, float(k), 0.0, 0.0), time_ns=stamp_ns)
    for k, stamp_ns in enumerate(STAMPS)
]
ROOTED = [tf(stamp_ns, "odom", "base_link", float(k)) for k, stamp_ns in enumerate(STAMPS)]


@pytest.mark.parametrize(
    ("messages", "said"),
    [
        (ODOMETRY, "the poses are those of its odometry, which drifts"),
        (ROOTED, "has no frame 'map': 'odom' is taken as the world"),
        ([tf(1, "map", "odom"), *ROOTED], ""),
    ],
    ids=["odometry", "another root", "map"],
)
def test_the_poses_of_a_bag_are_those_that_replay_takes(messages, said, caplog):
    trajectory = session_of(messages).trajectory
    assert tuple(trajectory.time_ns) == STAMPS
    np.testing.assert_allclose(trajectory.T_world_base[:, 0, 3], (0.0, 1.0))
    assert said in caplog.text
    assert bool(said) == bool(caplog.text)


@pytest.mark.parametrize("poses", [ODOMETRY, ROOTED, [tf(1, "map", "odom"), *ROOTED]])
def test_the_poses_of_an_aligned_session_lie_in_its_map(poses):
    aligned = encode(MapAlignment(position_map=(0.0, 7.0, 0.0), yaw_rad=math.pi / 2))
    messages = [*poses, SimpleNamespace(key=keys.MAP_ALIGNMENT, payload=aligned, time_ns=9)]
    trajectory = session_of(messages).trajectory
    places = [(0.0, 7.0, 0.0), (0.0, 8.0, 0.0)]
    np.testing.assert_allclose(trajectory.T_world_base[:, :3, 3], places, atol=1e-12)


@pytest.mark.parametrize("root", ["map", "odom"])
def test_a_base_that_is_called_something_else_is_named(root):
    messages = [tf(t, root, "base_footprint", float(k)) for k, t in enumerate(STAMPS)]
    with pytest.raises(RecordingError, match="--base-frame names a base"):
        _ = session_of(messages).trajectory
    trajectory = session_of(messages, robot=BagRobot(base="base_footprint")).trajectory
    assert tuple(trajectory.time_ns) == STAMPS
    np.testing.assert_allclose(trajectory.T_world_base[:, 0, 3], (0.0, 1.0))


def test_a_bag_that_has_a_base_link_keeps_it():
    with pytest.raises(RecordingError, match="has a frame 'base_link' already"):
        _ = session_of(ROOTED, robot=BagRobot(base="base_footprint")).trajectory


@pytest.mark.parametrize("poses", [ODOMETRY, ROOTED])
def test_the_poses_of_two_topics_are_not_mixed(poses):
    two = [SimpleNamespace(**vars(one), topic=f"/{n}") for n, one in enumerate(poses)]
    with pytest.raises(RecordingError, match=r"several topics that end in .*: /0, /1"):
        _ = session_of(two).trajectory


def test_a_second_odometry_is_nothing_to_a_bag_whose_poses_are_those_of_tf():
    two = [SimpleNamespace(**vars(one), topic=f"/{n}") for n, one in enumerate(ODOMETRY)]
    trajectory = session_of([*two, tf(1, "map", "odom"), *ROOTED]).trajectory
    assert tuple(trajectory.time_ns) == STAMPS


def test_poses_after_a_step_back_of_the_clock_are_kept_and_overtaken_ones_are_not(caplog):
    seconds = (8.0, 9.0, 8.9, 2.0, 3.0)
    messages = [tf(1, "map", "odom")]
    messages += [tf(round(s * 1e9), "odom", "base_link", float(k)) for k, s in enumerate(seconds)]
    trajectory = session_of(messages).trajectory
    assert tuple(trajectory.time_ns * 1e-9) == (8.0, 9.0, 2.0, 3.0)
    np.testing.assert_allclose(trajectory.T_world_base[:, 0, 3], (0.0, 1.0, 3.0, 4.0))
    assert "steps back of the robot's clock: 1; the times" in caplog.text


def test_a_bag_without_poses_is_refused():
    with pytest.raises(RecordingError, match="neither tf nor odometry leads to base_link"):
        _ = session_of([tf(1, "map", "odom")]).trajectory


def test_a_session_is_named_by_its_folder_and_a_file_among_others_by_itself(tmp_path, monkeypatch):
    folder = tmp_path / "morning"
    folder.mkdir()
    (folder / "session_0.mcap").touch()

    def name_of(path):
        recording = SimpleNamespace(path=path)
        return SessionData(path=path, recording=recording, timeline=None, scene=None).name

    assert name_of(folder / "session_0.mcap") == "morning"
    assert name_of(folder) == "morning"
    monkeypatch.chdir(folder)
    assert name_of(Path("session_0.mcap")) == "morning"
    (folder / "other.mcap").touch()
    assert name_of(folder) == "morning"
    assert name_of(Path("other.mcap")) == "other.mcap"


def test_the_floor_of_a_session_is_that_of_its_last_poses(tmp_path):
    folder = write_session(tmp_path, more=[alignment_at(9, (0.0, 0.0, -1.3))]).writer.folder
    session = read_session_data(folder)
    assert session.scene.floor_z_m == pytest.approx(-1.3)
    session.recording.close()
