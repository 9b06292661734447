"""Frames of a recording that has no poses: they are tracked."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from app.datasets.dataset import DatasetError, open_dataset
from app.datasets.messages import RobotMessage, dataset_messages
from app.messages import keys
from app.messages.depth.depth_images import encode_depth
from app.messages.images import encode_camera, encode_color
from app.messages.motion import encode_transforms, robot_transforms
from app.recognition import frames
from app.recognition.frames import FrameSource, open_source
from ippon.camera import PinholeCamera
from ippon.geometry import base_pose
from ippon.simulation.camera.renderer import SceneRenderer
from tests.boxes import boxes_scene
from tests.ippon.tracking.conftest import ROOM, held_pose

CAMERA = PinholeCamera.from_horizontal_fov(320, 240, 1.2)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Six frames, without poses."""
    folder = tmp_path_factory.mktemp("recording")
    renderer = SceneRenderer(boxes_scene(ROOM))
    entries = []
    for k in range(6):
        image = renderer.render(CAMERA, held_pose(k))
        Image.fromarray(image.color).save(folder / f"{k}.png")
        Image.fromarray((1000.0 * image.depth).astype(np.uint16)).save(folder / f"{k}.depth.png")
        entries.append({"color": f"{k}.png", "depth": f"{k}.depth.png"})
    k = {"fx": CAMERA.fx, "fy": CAMERA.fy, "cx": CAMERA.cx, "cy": CAMERA.cy}
    content = {
        "name": "held", "width": 320, "height": 240, "intrinsics": k, "depth_unit_m": 0.001,
        "rate_hz": 10.0, "gravity_world": [0.0, 1.0, 0.0], "frames": entries,
    }  # fmt: skip
    (folder / "sequence.json").write_text(json.dumps(content))
    return folder


@pytest.mark.slow
def test_frames_without_poses_are_tracked_above_the_floor(recording):
    tracked = list(open_source(recording, track=True).frames())
    assert len(tracked) == 6
    for k, frame in enumerate(tracked):
        assert frame.T_world_camera[2, 3] == pytest.approx(held_pose(k)[2, 3], abs=0.05)
        moved = np.linalg.norm(frame.T_world_camera[:3, 3] - tracked[0].T_world_camera[:3, 3])
        true = np.linalg.norm(held_pose(k)[:3, 3] - held_pose(0)[:3, 3])
        assert moved == pytest.approx(true, abs=0.02)


def test_a_recording_without_poses_needs_tracking(recording):
    with pytest.raises(DatasetError, match="has frames without a pose: they can be tracked"):
        open_source(recording)
    sent = list(dataset_messages(open_dataset(recording, poses=False), 0.0, 0, None))
    assert {one.key for one in sent} == {keys.COLOR, keys.DEPTH, keys.CAMERA_INFO}


def test_a_recording_that_never_shows_the_floor_is_refused(recording, tmp_path):
    content = json.loads((recording / "sequence.json").read_text())
    Image.fromarray(np.full((240, 320), 2000, np.uint16)).save(tmp_path / "wall.png")
    Image.open(recording / "0.png").save(tmp_path / "0.png")
    content["frames"] = [{"color": "0.png", "depth": "wall.png"}]
    (tmp_path / "sequence.json").write_text(json.dumps(content))
    with pytest.raises(DatasetError, match="held: no frame shows the floor"):
        list(open_source(tmp_path, track=True).frames())


def posed(recording, tmp_path, change):
    """A copy of the recording with true poses, changed."""
    content = json.loads((recording / "sequence.json").read_text())
    for k, entry in enumerate(content["frames"]):
        names = {kind: str(recording / entry[kind]) for kind in ("color", "depth")}
        entry.update(names, camera_to_world=held_pose(k).tolist())
    content["gravity_world"] = [0.0, 0.0, -1.0]
    change(content)
    (tmp_path / "sequence.json").write_text(json.dumps(content))
    return tmp_path


def test_frames_whose_pose_was_lost_are_left_out_and_counted(recording, tmp_path):
    lost = np.full((4, 4), np.nan).tolist()
    source = open_source(
        posed(recording, tmp_path, lambda one: one["frames"][2].update(camera_to_world=lost))
    )
    assert len(list(source.frames())) == 5
    assert source.tally.note.startswith("1 of 6 colour images were not mapped, for want of a pose")


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda one: one.pop("depth_unit_m"), r"sequence\.json lacks the field 'depth_unit_m'"),
        (lambda one: one["frames"][1].pop("depth"), r"sequence\.json lacks the field 'depth'"),
        (
            lambda one: one["frames"][1].update(camera_to_world=np.eye(3).tolist()),
            r"frame 1 of sequence\.json: camera_to_world has the shape \(3, 3\); it is 4 rows",
        ),
        (
            lambda one: [
                frame.update(camera_to_world=np.diag([-1.0, 1.0, 1.0, 1.0]).tolist())
                for frame in one["frames"]
            ],
            "6 colour images have no depth image of their time, or no pose that is a rotation",
        ),
        (lambda one: one.update(rate_hz=0), r"rate_hz of sequence\.json is 0; it takes images a s"),
        (lambda one: one["frames"].clear(), "has no frame with colour, depth and pose$"),
    ],
)
def test_a_description_with_a_mistake_is_refused_by_name(recording, tmp_path, change, text):
    with pytest.raises(DatasetError, match=text):
        open_source(posed(recording, tmp_path, change))


def test_only_datasets_are_tracked(tmp_path):
    bag = tmp_path / "a.mcap"
    bag.write_bytes(b"")
    with pytest.raises(DatasetError, match=r"is a bag: .* and `ippon replay --no-poses`$"):
        open_source(bag, track=True)


def test_the_clock_offset_of_a_profile_shifts_the_poses_of_a_bag(monkeypatch):
    def posed(stamp_ns, x):
        T_world_base = base_pose(x, 0.0, 0.0, 0.0)
        return encode_transforms(robot_transforms(stamp_ns, T_world_base, np.eye(4), "c"))

    at = 1_500_000_000
    payloads = [(keys.TF, posed(at + 30_000_000 * n, 0.3 * n)) for n in range(-2, 3)] + [
        (keys.CAMERA_INFO, encode_camera(CAMERA, at, "c")),
        (keys.DEPTH, encode_depth(np.ones((240, 320), np.float32), at, "c")),
        (keys.COLOR, encode_color(np.zeros((240, 320, 3), np.uint8), at, "c")),
    ]
    sent = [RobotMessage(0.0, key, payload) for key, payload in payloads]
    monkeypatch.setattr(frames, "bag_messages", lambda *_, **__: iter(sent))
    source = FrameSource(Path("bag"), None, np.eye(4), clock_offset_s=0.03)
    (frame,) = source.frames()
    assert frame.T_world_base[0, 3] == pytest.approx(0.3)
