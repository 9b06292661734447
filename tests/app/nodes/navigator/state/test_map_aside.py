from dataclasses import replace

import pytest

from app.memory.memory_file import journal_path, memory_path
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.state.map_aside import (
    copy_aside,
    move_aside,
    new_map_for_tracking,
    without_map,
)
from app.nodes.navigator.state.persistence import SavedFind, SavedGoal, SavedState
from app.robot_file import read_profile
from ippon.mapping.config import MapConfig
from ippon.mapping.voxel_map import VoxelMap


def test_a_tracked_camera_does_not_map_into_the_frame_of_yesterday(tmp_path):
    path = tmp_path / "home.map"
    path.write_bytes(b"map")
    memory_path(path).write_bytes(b"things")
    saved = SavedState(voxel_map=VoxelMap(MapConfig(memory_limit_mb=64.0), ("wall",)), requests=())
    sends_poses = NavigatorConfig(keep_map=str(path))
    assert new_map_for_tracking(sends_poses, saved) == (saved, "")
    held = replace(sends_poses, profile=read_profile("hand-held"))
    assert new_map_for_tracking(held, None) == (None, "")
    anew, note = new_map_for_tracking(held, saved)
    assert anew == replace(saved, voxel_map=None)
    assert "is kept as home.map.aside-1, and a new map begins" in note
    assert sorted(one.name for one in tmp_path.iterdir()) == [
        "home.map.aside-1", "home.map.aside-1.memory",
    ]  # fmt: skip
    assert memory_path(tmp_path / "home.map.aside-1").read_bytes() == b"things"


def test_finds_of_another_frame_are_neither_excluded_nor_counted():
    find = SavedFind(
        position_world=(1.0, 2.0, 0.5), size_m=(0.5, 0.5, 0.9), probability=0.9, voxels=40
    )
    chairs = SavedGoal(object="chair", count=3, counted=[find], levels={"sofa": "near"})
    mug = SavedGoal(object="mug", rejected=[find], joins=1)
    voxel_map = VoxelMap(MapConfig(memory_limit_mb=64.0), ("wall",))
    saved = SavedState(voxel_map=voxel_map, requests=(chairs, mug))
    anew, note = without_map(saved, "a new map begins")
    # All three: the one that was counted is among what the robot finds again.
    assert anew.requests == (
        SavedGoal(object="chair", count=3, levels={"sofa": "near"}),
        SavedGoal(object="mug", joins=1),
    )
    assert anew.voxel_map is None
    assert note.startswith("a new map begins; finds that were counted or rejected")
    assert without_map(anew, "a new map begins") == (anew, "a new map begins")


@pytest.mark.parametrize("put", [copy_aside, move_aside])
def test_a_memory_keeps_what_undoes_a_write_that_was_cut_off(tmp_path, put):
    path = tmp_path / "home.map"
    path.write_bytes(b"map")
    memory_path(path).write_bytes(b"things")
    journal_path(memory_path(path)).write_bytes(b"before")
    aside = put(path)
    assert journal_path(memory_path(aside)).read_bytes() == b"before"
    assert journal_path(memory_path(path)).exists() == (put is copy_aside)
