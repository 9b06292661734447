import math

import numpy as np
import pytest

from app.messages.images import CompressedColor, StampedCamera
from app.messages.memory import MapAlignment
from app.messages.motion import StampedTransform, robot_transforms
from app.messages.status import Event, FarEvidenceCells, GoalStatus
from app.view.model.scene_model import SceneModel
from ippon.camera import PinholeCamera
from ippon.geometry import base_pose, make_transform


@pytest.fixture
def model(make):
    """A model that knows the voxel size."""
    model = SceneModel()
    model.on_status(make.status())
    model.take_changes()
    return model


def _voxels(model):
    return {tuple(i) for i in model.voxels.all_voxels()[0].tolist()}


def _move(model, x, stamp_ns=1, z=0.0):
    T = base_pose(x, 0.0, z, 0.0)
    model.on_transforms(
        [StampedTransform(stamp_ns=stamp_ns, parent="map", child="base_link", T_parent_child=T)]
    )


def test_a_robot_that_is_aligned_to_an_old_map_is_shown_where_it_is_there(model):
    _move(model, 1.0)
    model.on_alignment(MapAlignment(position_map=(2.0, 3.0, 0.0), yaw_rad=math.pi / 2.0))
    assert model.T_world_base[:3, 3] == pytest.approx((2.0, 4.0, 0.0))
    _move(model, 2.0, stamp_ns=2)
    assert model.T_world_base[:3, 3] == pytest.approx((2.0, 5.0, 0.0))


def test_changes_are_told_once(model, make):
    model.on_voxels(make.cloud([(0, 0, 0)]))
    assert model.take_changes() == {"voxels"}
    assert model.take_changes() == frozenset()


def test_voxels_come_and_go(model, make):
    model.on_voxels(make.cloud([(0, 0, 0), (5, -3, 2)]))
    model.on_voxels(make.cloud([(0, 0, 0)], removed=True))
    assert _voxels(model) == {(5, -3, 2)}


def test_voxels_before_the_first_status_are_kept(make):
    model = SceneModel()
    model.on_voxels(make.cloud([(1, 1, 1)]))
    assert model.voxels.count == 0
    model.on_status(make.status())
    assert _voxels(model) == {(1, 1, 1)}


def test_a_late_joiner_ends_with_the_same_map(make):
    deltas = [
        make.cloud([(0, 0, 0), (1, 0, 0)], 10),
        make.cloud([(2, 0, 0)], 20),
        make.cloud([(0, 0, 0)], 30, removed=True),
        make.cloud([(3, 0, 0)], 40),
    ]
    early, late = SceneModel(), SceneModel()
    for model in (early, late):
        model.on_status(make.status())
    early.on_keyframe(make.cloud(np.empty((0, 3)), 0))
    for delta in deltas:
        early.on_voxels(delta)
    # Joins before the second change; the keyframe that it gets already holds the third.
    for delta in deltas[1:]:
        late.on_voxels(delta)
    late.on_keyframe(make.cloud([(1, 0, 0), (2, 0, 0)], 30))
    assert _voxels(late) == _voxels(early) == {(1, 0, 0), (2, 0, 0), (3, 0, 0)}
    assert not late.needs_keyframe


def test_the_newest_change_wins_over_an_older_keyframe(model, make):
    model.on_voxels(make.cloud([(0, 0, 0)], 50, removed=True))
    model.on_keyframe(make.cloud([(0, 0, 0), (1, 0, 0)], 40))
    assert _voxels(model) == {(1, 0, 0)}


@pytest.mark.parametrize("change", [{"map_revision": 0}, {"voxel_size_m": 0.2}, {"robot": "other"}])
def test_a_restarted_navigator_means_a_new_map(model, make, change):
    model.on_keyframe(make.cloud([(0, 0, 0)]))
    _move(model, 1.0)
    model.on_status(make.status(**change))
    assert model.voxels.count == 0
    assert model.needs_keyframe
    assert model.trail_world == []
    assert {"voxels", "pose", "tree", "path"} <= model.take_changes()


def test_the_camera_is_found_through_the_chain_of_frames(model):
    camera = PinholeCamera.from_horizontal_fov(64, 40, 1.2)
    model.on_camera(StampedCamera(stamp_ns=1, frame_id="optical", camera=camera))
    assert model.T_world_camera is None
    T_base_camera = make_transform(np.eye(3), (0.1, 0.0, 1.2))
    T_world_base = base_pose(2.0, 1.0, 0.0, math.pi / 2)
    model.on_transforms(robot_transforms(1, T_world_base, T_base_camera, "optical")[::-1])
    assert model.T_world_camera is not None
    np.testing.assert_allclose(model.T_world_camera[:3, 3], (2.0, 1.1, 1.2), atol=1e-12)


def test_a_picture_has_the_pose_of_its_own_time(model):
    camera = PinholeCamera.from_horizontal_fov(64, 40, 1.2)
    model.on_camera(StampedCamera(stamp_ns=1, frame_id="optical", camera=camera))
    T_base_camera = make_transform(np.eye(3), (0.1, 0.0, 1.2))
    image = CompressedColor(stamp_ns=300_000_000, frame_id="optical", encoded=b"")
    # Of a batch the images come first.
    model.on_image(image)
    for n in range(6):
        T_world_base = base_pose(0.0, 0.0, 0.0, 0.1 * n)
        stamp_ns = 100_000_000 * n
        model.on_transforms(robot_transforms(stamp_ns, T_world_base, T_base_camera, "optical"))
    assert "image" in model.take_changes()
    T = model.pictures.find(0).T_world_camera
    assert math.atan2(T[1, 0], T[0, 0]) == pytest.approx(0.3)


def test_frames_in_a_circle_lead_nowhere(model):
    eye = np.eye(4)
    model.on_transforms(
        [
            StampedTransform(stamp_ns=1, parent="b", child="base_link", T_parent_child=eye),
            StampedTransform(stamp_ns=1, parent="base_link", child="b", T_parent_child=eye),
        ]
    )
    assert model.T_world_base is None


def test_another_floor_draws_anew_what_depends_on_its_height(model, make):
    model.on_voxels(make.cloud([(0, 0, 30), (40, 0, 30)]))
    _move(model, 0.0, 1, z=3.0)
    assert model.floor_z_m == 3.0
    assert model.take_changes() == {"voxels", "painted", "far_evidence", "pose"}
    _, revision = model.voxels.changed_since(0)
    for n in range(5):
        _move(model, 0.1 * n, (2 + n) * 10**9, z=3.05)
    assert (model.floor_z_m, model.take_changes()) == (3.0, {"pose"})
    assert model.voxels.changed_since(revision)[0] == (), "the same floor draws nothing anew"
    for n in range(3):
        _move(model, 1.0, (10 + n) * 10**9, z=6.0)
    assert model.floor_z_m == 6.0
    assert set(model.voxels.changed_since(revision)[0]) == set(model.voxels.columns)
    model.on_status(make.status(robot="other"))
    _move(model, 1.0, 20 * 10**9, z=-1.3)
    assert model.floor_z_m == -1.3, "the first pose in another world is on its floor"


def test_the_floor_is_followed_where_the_base_is_fixed_to_a_frame_that_moves(model):
    lifted = base_pose(0.0, 0.0, 0.1, 0.0)
    link = {"parent": "base_footprint", "child": "base_link", "T_parent_child": lifted}
    model.on_transforms([StampedTransform(stamp_ns=0, **link)], fixed=True)
    for n, z in enumerate([0.0, 3.0, 3.0, 3.0]):
        pose = {"parent": "map", "child": "base_footprint"}
        T = base_pose(0.0, 0.0, z, 0.0)
        model.on_transforms([StampedTransform(stamp_ns=n * 10**9, **pose, T_parent_child=T)])
    assert model.floor_z_m == pytest.approx(3.1)


def test_a_floor_at_zero_draws_nothing_anew(model, make):
    model.on_voxels(make.cloud([(0, 0, 0)]))
    model.take_changes()
    _move(model, 1.0)
    assert model.take_changes() == {"pose"}


def test_the_trail_grows_with_the_way_not_with_the_messages(model):
    for n in range(100):
        _move(model, 0.01 * n, n)
    assert 18 <= len(model.trail_world) <= 21


def test_the_history_keeps_its_size(model, make):
    for n in range(10_000):
        model.on_status(make.status(stamp_ns=n * 600_000_000, best_ooi=n / 10_000))
    columns = model.history.columns()
    assert columns.shape[0] == 6
    assert 300 < columns.shape[1] < 1300
    assert (np.diff(columns[0]) > 0).all()
    assert columns[1, -1] > 0.99


def test_what_was_rejected_stays_rejected_until_another_goal(model, make):
    find = make.find()
    model.on_status(make.status(state="found", find=find))
    model.on_status(make.status())
    assert model.rejected == ()
    model.on_event(Event(stamp_ns=1, kind="rejected", text="not the hat: continuing the search"))
    assert "detections" in model.take_changes()
    model.on_status(make.status())
    assert model.rejected == (find,)
    model.on_event(Event(stamp_ns=2, kind="rejected", text="nothing to point at"))
    assert model.rejected == (find,), "the same find is not rejected twice"
    model.on_status(make.status(state="found", find=make.find(number=3)))
    model.on_event(Event(stamp_ns=3, kind="rejected", text="not the hats 1", find=1))
    assert model.rejected == (find,), "it was another one of several"
    model.on_status(make.status(goal=GoalStatus(goal_id=2, object="plant")))
    assert model.rejected == ()


def test_places_are_worked_out_once_for_a_state(model, make):
    model.on_keyframe(make.cloud([(0, 0, 0)], ooi=100))
    model.on_status(make.status(state="exhausted"))
    first = model.candidates()
    assert [place.probability for place in first] == [pytest.approx(100 / 254)]
    model.on_voxels(make.cloud([(0, 0, 0)], 2, ooi=200))
    model.on_status(make.status(state="exhausted"))
    assert model.candidates() is first
    model.on_status(make.status(state="searching"))
    assert model.candidates()[0].probability == pytest.approx(200 / 254)


def test_far_evidence_is_drawn_again_only_when_it_changes(model, make):
    places = FarEvidenceCells(stamp_ns=1, cell_m=0.25, cells=[(4.0, 1.0, 2.5)])
    model.on_far_evidence(places)
    assert model.take_changes() == {"far_evidence"}
    model.on_far_evidence(FarEvidenceCells(stamp_ns=2, cell_m=0.25, cells=places.cells))
    assert model.take_changes() == frozenset()
    old = FarEvidenceCells(stamp_ns=2, cell_m=0.25, cells=places.cells, covered=[(1, 2, 3)])
    model.on_far_evidence(old)
    assert model.take_changes() == frozenset(), "a field of earlier recordings is ignored"
    for edge in (0.0, -1.0, 1e9):
        model.on_far_evidence(FarEvidenceCells(stamp_ns=3, cell_m=edge, cells=[]))
    assert model.far_evidence is places, "cells without a size are no cells"
    model.on_status(make.status(robot="other"))
    assert model.far_evidence.cells == []
