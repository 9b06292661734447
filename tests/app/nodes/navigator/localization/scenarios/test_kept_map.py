"""A navigator that starts with the map of another day."""

import threading

import numpy as np
import pytest

from app.memory.memory_file import memory_path, read_memory
from app.messages import keys
from app.messages.control import SearchRequest, encode
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.node import Navigator
from app.nodes.navigator.state import persistence
from app.nodes.navigator.state.persistence import read_saved_state
from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform
from ippon.mapping.voxel_map import VoxelMap
from ippon.vocabulary import MATTERPORT_40
from tests.app.nodes.navigator.scenarios.standing_robot import Robot


def map_at(path, x):
    """Keep a map of a wall."""
    config = NavigatorConfig(robot="r").mission.map
    voxel_map = VoxelMap(config, MATTERPORT_40)
    voxel_map.integrate(
        Frame(
            stamp_ns=0,
            color=np.zeros((24, 32, 3), np.uint8),
            depth=np.full((24, 32), 2.0, np.float32),
            camera=PinholeCamera.from_horizontal_fov(32, 24, 1.2),
            T_world_camera=make_transform(R_BASE_CAMERA_LEVEL, (x, 0.0, 1.0)),
            T_world_base=make_transform(np.eye(3), (x, 0.0, 0.0)),
            tilt_rad=0.0,
        )
    )
    voxel_map.save(path)
    return read_saved_state(path, config)


@pytest.mark.slow
def test_a_map_of_which_nothing_is_in_view_is_not_written_over_and_not_confirmed(
    sessions, tmp_path, monkeypatch, caplog
):
    monkeypatch.setattr(persistence, "FIRST_AFTER_S", 0.0)
    path = tmp_path / "home.map"
    saved = map_at(path, 60.0)
    before = path.read_bytes()
    router, client = sessions
    robot = Robot(client)
    config = NavigatorConfig(robot="r", keep_map=str(path))
    navigator, stop = Navigator(config, router, saved=saved), threading.Event()
    thread = threading.Thread(target=navigator.run, args=(stop,))
    thread.start()
    try:
        request = encode(SearchRequest(object="hat"))
        list(client.get(f"r/{keys.SEARCH}", payload=request, timeout=10.0))
        status = robot.send_until(lambda s: s.frames > 5, 120.0)
        assert any("the kept map is not confirmed yet" in note for note in status.notes)
        assert status.surface_voxels > 0
    finally:
        stop.set()
        thread.join()
        navigator.close()
    assert path.read_bytes() == before
    assert "home.map stays as it was" in caplog.text
    assert read_memory(memory_path(path)) == ()
