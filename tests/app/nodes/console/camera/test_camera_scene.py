import msgspec
import numpy as np
import pytest

from app.messages.scene import FoundObject
from app.nodes.console.camera.camera_scene import camera_scene
from app.view.model.scene_model import SceneModel
from app.view.model.voxel_store import VoxelUpdate
from app.view.words import Words


def test_finds_path_and_drive_are_drawn(stage):
    model = SceneModel()
    model.on_status(stage.status_of("found", find=stage.find_of()))
    scene = camera_scene(model)
    assert scene.wanted == "hat"
    (find,) = scene.objects
    assert find.found
    assert find.text == "hat 93%"
    (find,) = camera_scene(model, Words("de")).objects
    assert find.text == "Hut 93\u00a0%"


def test_candidates_are_not_finds_and_are_bounded(stage):
    model = SceneModel()
    model.on_status(stage.status_of())
    model.on_detections(
        tuple(
            FoundObject(
                label="hat", probability=0.5, center_world=(float(n), 0.0, 0.5), size_m=(0.2,) * 3
            )
            for n in range(30)
        )
    )
    scene = camera_scene(model)
    assert len(scene.objects) == 8
    assert not any(one.found for one in scene.objects)


def test_nothing_is_drawn_without_a_navigator():
    scene = camera_scene(SceneModel())
    assert scene.objects == ()
    assert scene.T_world_base is None


def test_a_doubtful_find_has_a_question_mark(stage):
    model = SceneModel()
    find = msgspec.structs.replace(stage.find_of(), perhaps=True)
    model.on_status(stage.status_of("found", find=find))
    assert camera_scene(model).objects[0].text == "hat? 93%"


@pytest.fixture
def walled(stage):
    """What a camera at the origin has a wall 2 m before."""
    model = SceneModel()
    model.on_status(stage.status_of())
    model.camera_poses.append((0, np.eye(4)))
    wall = np.array([(20, j, k) for j in range(-30, 30) for k in range(-30, 30)])
    n = len(wall)
    model.voxels.apply(
        VoxelUpdate(
            indices=np.floor(wall * 0.1 / model.voxel_size_m).astype(np.int64),
            attributes=np.zeros((n, 8), np.uint8),
            surface=np.ones(n, np.bool_),
        )
    )
    return model


def test_a_candidate_behind_a_wall_is_not_drawn_over_the_picture(walled):
    seen, behind = (
        FoundObject(label="hat", probability=0.5, center_world=(x, 0.0, 0.0), size_m=(0.2,) * 3)
        for x in (1.0, 3.0)
    )
    walled.on_detections((seen, behind))
    (one,) = camera_scene(walled).objects
    assert one.center_world == seen.center_world


@pytest.mark.parametrize(("x_m", "hidden"), [(1.0, False), (3.0, True)])
def test_a_find_behind_a_wall_is_drawn_as_hidden(walled, stage, x_m, hidden):
    find = msgspec.structs.replace(stage.find_of(), position_world=(x_m, 0.0, 0.0))
    walled.on_status(stage.status_of("found", find=find))
    (one,) = camera_scene(walled).objects
    assert (one.found, one.hidden) == (True, hidden)
    assert one.text == ("hat 93%, hidden" if hidden else "hat 93%")
    (german,) = camera_scene(walled, Words("de")).objects
    assert german.text.endswith(", verdeckt") == hidden
