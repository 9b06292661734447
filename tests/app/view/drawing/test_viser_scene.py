"""The layers, drawn into a real viser server; what it would send is what is checked."""

import dataclasses
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest
import viser

from app.messages import keys
from app.messages.driving import PaintedRegions, PaintedStroke
from app.messages.images import CompressedColor, StampedCamera
from app.messages.motion import StampedPath, StampedTransform, robot_transforms
from app.messages.scene import FoundObject
from app.messages.status import CountedFind, FarEvidenceCells, GoalStatus, LevelRow, LevelTable
from app.nodes.navigator.config import NavigatorConfig
from app.view.colors import voxel_colors
from app.view.drawing import viser_scene, voxel_layer
from app.view.drawing.find_layer import found_before, marks_of
from app.view.drawing.robot_layer import RobotLayer
from app.view.drawing.viser_scene import ALL_PARTS, GAINS_S, ViserScene
from app.view.drawing.voxel_layer import NEAR_M
from app.view.model.scene_model import SceneModel
from app.view.model.scene_reader import SceneReader
from app.view.view_options import LAYERS, ViewOptions
from ippon.camera import PinholeCamera
from ippon.geometry import base_pose
from ippon.planning.plan import TreeView
from ippon.robot import ZED, CollisionSphere


@pytest.fixture
def model(make):
    """A floor of 4 m by 4 m, with a spot where the object may be."""
    model = SceneModel()
    model.on_status(make.status())
    floor = [(i, j, 0) for i in range(40) for j in range(40)]
    model.on_voxels(make.cloud(floor))
    model.on_voxels(make.cloud([(20, 20, 3), (20, 21, 3)], 2, ooi=200))
    return model


def _node(server, name):
    return server.scene.get_handle_by_name(name)


def _sent(server):
    return server._websock_server._broadcast_buffer.message_counter


def _draw(server, model, **options):
    scene = ViserScene(server)
    scene.draw(model, ALL_PARTS, ViewOptions(**options))
    return scene


def test_the_map_is_one_cloud_a_column_and_boxes_where_the_object_may_be(server, model):
    scene = _draw(server, model)
    assert scene.voxels.shown == 9
    cloud = _node(server, "/map/1_1")
    assert cloud.points.shape == (256, 3)
    assert cloud.points.dtype == np.float16
    boxes = _node(server, "/object_voxels")
    np.testing.assert_allclose(boxes.batched_positions, [[2.05, 2.05, 0.35], [2.05, 2.15, 0.35]])


def test_world_positions_survive_the_half_precision(server, model, make):
    model.on_voxels(make.cloud([(-1003, 2005, 29)]))
    _draw(server, model, ceiling_m=None)
    cloud = _node(server, f"/map/{-1003 // 16}_{2005 // 16}")
    world = np.asarray(cloud.position) + cloud.points.astype(float) * cloud.scale
    np.testing.assert_allclose(world, [[-100.25, 200.55, 2.95]], atol=1e-6)


def test_layers_far_above_the_origin_stay_apart(server, model, make):
    model.on_voxels(make.cloud([(1000, 1000, k) for k in range(10_402, 10_412)]))
    scene = _draw(server, model, ceiling_m=None)
    model.on_voxels(make.cloud([(1000, 1000, 10_400), (1000, 1000, 10_401)]))
    scene.draw(model, model.take_changes(), ViewOptions(ceiling_m=None))
    cloud = _node(server, "/map/62_62")
    heights = cloud.position[2] + np.sort(cloud.points[:, 2].astype(float)) * cloud.scale
    np.testing.assert_allclose(heights, 0.1 * np.arange(10_400.5, 10_412.0), atol=1e-3)


def test_a_change_sends_what_changed_only(server, model, make):
    scene = _draw(server, model)
    model.take_changes()
    before = _sent(server)
    model.on_voxels(make.cloud([(3, 3, 1)], 5))
    scene.draw(model, model.take_changes(), ViewOptions())
    assert 1 <= _sent(server) - before <= 3
    before = _sent(server)
    scene.draw(model, model.take_changes(), ViewOptions())
    assert _sent(server) == before


def test_a_colour_mode_changes_colours_and_no_points(server, model):
    scene = _draw(server, model)
    before = _node(server, "/map/0_0").colors.copy()
    scene.draw(model, frozenset(), ViewOptions(mode="proximity"))
    after = _node(server, "/map/0_0").colors
    assert before.shape == after.shape
    assert (before != after).any()


def test_another_colour_mode_gathers_no_voxels(server, model, make, monkeypatch):
    scene = _draw(server, model)
    gathered = []
    column = model.voxels.column
    monkeypatch.setattr(
        model.voxels, "column", lambda which, below: gathered.append(which) or column(which, below)
    )
    scene.draw(model, frozenset(), ViewOptions(mode="height"))
    assert gathered == []
    model.on_voxels(make.cloud([(3, 3, 1)], 5))
    scene.draw(model, model.take_changes() | {"voxels"}, ViewOptions(mode="height"))
    assert gathered == [(0, 0)]
    scene.draw(model, frozenset(), ViewOptions(mode="height", ceiling_m=None))
    assert len(gathered) == 1 + 9, "another cut is another map"


def test_a_voxel_has_the_gain_of_the_viewpoint_nearest_to_it(server, make, monkeypatch):
    rng, model, shown = np.random.default_rng(3), SceneModel(), {}
    model.on_status(make.status())
    model.on_voxels(make.cloud(rng.integers((16, -16, 0), (32, 0, 3), (300, 3))))
    xy, gains = rng.uniform((0, -3), (5, 2), (9, 2)), rng.uniform(0, 9, 9).astype(np.float32)
    xy = xy.astype(np.float32)
    positions = np.column_stack([xy, np.zeros(9, np.float32)])
    model.on_tree(dataclasses.replace(_tree(9), positions_world=positions, gains=gains))
    monkeypatch.setattr(
        voxel_layer, "voxel_colors", lambda mode, **of: shown.update(of) or voxel_colors(mode, **of)
    )
    _draw(server, model, mode="gain", layers=frozenset({"map"}))
    centers = (model.voxels.column((1, -1)).local[:, :2] + [16, -16] + 0.5) * 0.1
    apart = np.linalg.norm(centers[:, None] - xy, axis=2)
    nearest = apart.argmin(axis=1)
    expected = (gains[nearest] / gains.max() * 254).astype(np.uint8)
    expected[apart.min(axis=1) > NEAR_M] = 255
    assert 20 < np.count_nonzero(expected == 255) < len(expected) - 20
    np.testing.assert_array_equal(shown["gain"], expected)
    model.on_tree(_tree(0))
    _draw(server, model, mode="gain", layers=frozenset({"map"}))
    assert (shown["gain"] == 255).all()


def test_gains_are_coloured_again_some_time_after_the_last_drawing(server, model, monkeypatch):
    now = [100.0]
    monkeypatch.setattr(viser_scene, "time", SimpleNamespace(monotonic=lambda: now[0]))
    scene, options, drawn = ViserScene(server), ViewOptions(mode="gain"), []

    def draw_for_5_s(store, voxel_size_m, dirty, options, floor_z_m):
        drawn.append(len(dirty))
        now[0] += 5.0

    monkeypatch.setattr(scene.voxels, "draw", draw_for_5_s)
    model.on_tree(_tree(5))
    scene.draw(model, ALL_PARTS, options)
    now[0] += GAINS_S - 0.5
    scene.draw(model, frozenset({"tree"}), options)
    assert len(drawn) == 1
    now[0] += 0.5
    scene.draw(model, frozenset({"tree"}), options)
    assert drawn == [9, 9]


def test_the_map_reaches_as_far_as_its_voxels(server, model, make):
    scene = _draw(server, model)
    low, high = scene.bounds()
    np.testing.assert_allclose([low, high], [[0.0, 0.0], [4.0, 4.0]])
    model.on_voxels(make.cloud([(-3, 50, 0)], 5))
    scene.draw(model, model.take_changes(), ViewOptions())
    low, high = scene.bounds()
    np.testing.assert_allclose([low, high], [[-0.3, 0.0], [4.0, 5.1]])


def test_the_ceiling_is_cut(server, model, make):
    model.on_voxels(make.cloud([(0, 0, k) for k in range(30)]))
    scene = _draw(server, model, ceiling_m=1.0)
    assert _node(server, "/map/0_0").points[:, 2].max() < 10
    scene.draw(model, frozenset(), ViewOptions(ceiling_m=None))
    assert _node(server, "/map/0_0").points[:, 2].max() == 29.5


def test_a_mesh_without_a_voxel_below_the_cut_is_removed(server, model, make):
    options = {"layers": frozenset({"mesh", "clearance"})}
    scene = _draw(server, model, **options)
    assert _node(server, "/skin") is not None
    scene.draw(model, frozenset(), ViewOptions(ceiling_m=0.0, **options))
    assert _node(server, "/skin") is None
    scene.draw(model, frozenset(), ViewOptions(**options))
    assert _node(server, "/skin") is not None
    model.on_status(make.status(robot="another"))
    scene.draw(model, model.take_changes(), ViewOptions(ceiling_m=2.0, **options))
    assert _node(server, "/skin") is None, "the map of another robot is empty at first"
    assert _node(server, "/clearance") is None
    model.on_voxels(make.cloud([(3, 3, 9)]))
    scene.draw(model, model.take_changes(), ViewOptions(**options))
    assert _node(server, "/skin") is not None


@pytest.mark.parametrize("layers", [30, -13])
def test_another_floor_is_drawn_as_the_one_at_zero(server, make, layers):
    below, here = (_floor_drawn(server, make, lift) for lift in (0, layers))
    assert below["points"].max() == 13.5
    for name, values in here.items():
        # The shade of a voxel varies with its index.
        atol = 25.0 if name == "colors" else 2e-5
        np.testing.assert_allclose(values, below[name], atol=atol, err_msg=name)


def _floor_drawn(server, make, layers):
    """Draw a floor in a layer of voxels, and return the heights above it of what is drawn."""
    model = SceneModel()
    model.on_status(make.status())
    _stand(model, 0.1 * layers)
    floor = [(i, j, layers) for i in range(40) for j in range(40)]
    model.on_keyframe(make.cloud([*floor, *((5, 5, layers + k) for k in range(26))]))
    model.on_painted(PAINTED)
    model.on_far_evidence(FarEvidenceCells(stamp_ns=1, cell_m=0.25, cells=[(3.0, 1.0, 3.0)]))
    scene = _draw(server, model, mode="height", layers=frozenset(LAYERS) - {"mesh"})
    column = _node(server, "/map/0_0")
    order = np.lexsort(column.points.T)
    lowest = round(column.position[2] / 0.1)
    drawn = {"points": column.points[order, 2].astype(float) + lowest - layers}
    drawn["colors"] = column.colors[order].astype(float)
    drawn["/floor"] = _node(server, "/floor").position[2:] - 0.1 * layers
    drawn["/clearance"] = _node(server, "/clearance").points[:, 2] - 0.1 * layers
    for name in ("/painted/look_here", "/far_evidence/strong"):
        drawn[name] = _node(server, name).vertices[:, 2] - 0.1 * layers
    # The mesh stands for the voxels, which are not drawn then.
    scene.draw(model, frozenset(), ViewOptions(layers=frozenset({"mesh"})))
    drawn["/skin"] = np.sort(_node(server, "/skin").vertices[:, 2]) - 0.1 * layers
    return drawn


def test_the_drawing_follows_the_robot_to_another_floor(server, model, make):
    model.on_voxels(make.cloud([(3, 3, k) for k in range(60)]))
    _stand(model, 0.0)
    scene = _draw(server, model)
    model.take_changes()
    assert _node(server, "/map/0_0").points[:, 2].max() == 13.5
    before = _sent(server)
    _stand(model, 0.05, 2 * 10**9)
    scene.draw(model, model.take_changes() - {"pose"}, ViewOptions())
    assert _sent(server) == before, "the same floor"
    for n in range(3):
        _stand(model, 3.0, (4 + n) * 10**9)
    scene.draw(model, model.take_changes(), ViewOptions())
    assert _node(server, "/map/0_0").points[:, 2].max() == 43.5
    assert _node(server, "/floor").position[2] == pytest.approx(2.94)


PAINTED = PaintedRegions(
    regions=[PaintedStroke(kind="look_here", strokes=[(1.0, 1.0)], radius_m=0.5)]
)


def _stand(model, z, stamp_ns=1):
    T_world_base = base_pose(1.0, 2.0, z, 0.0)
    model.on_transforms(robot_transforms(stamp_ns, T_world_base, ZED.T_base_camera(0.0), "optical"))


def test_boxes_follow_the_threshold(server, model, make):
    scene = _draw(server, model, object_threshold=0.5)
    assert len(_node(server, "/object_voxels").batched_positions) == 2
    scene.draw(model, frozenset(), ViewOptions(object_threshold=0.9))
    assert not _node(server, "/object_voxels").visible
    model.on_voxels(make.cloud([(20, 22, 3)], 9, ooi=254))
    scene.draw(model, model.take_changes(), ViewOptions(object_threshold=0.9))
    assert _node(server, "/object_voxels").visible
    assert len(_node(server, "/object_voxels").batched_positions) == 1


def test_a_new_map_replaces_the_old_one(server, model, make):
    scene = _draw(server, model)
    model.on_status(make.status(map_revision=0, voxel_size_m=0.1))
    model.on_keyframe(make.cloud([(0, 0, 0)], 1))
    scene.draw(model, model.take_changes(), ViewOptions())
    assert scene.voxels.shown == 1
    assert not _node(server, "/object_voxels").visible
    assert _node(server, "/map/0_0") is not None
    assert _node(server, "/map/1_1") is None, "nothing is left of the old map"


def test_an_old_map_is_removed_also_where_options_change_with_it(server, model, make):
    scene = _draw(server, model)
    model.on_status(make.status(robot="another"))
    scene.draw(model, model.take_changes(), ViewOptions(mode="height"))
    assert _node(server, "/map/0_0") is None
    model.on_voxels(make.cloud([(0, 0, 0)]))
    scene.draw(model, model.take_changes(), ViewOptions(mode="height"))
    assert _node(server, "/map/0_0").visible


def test_what_was_seen_from_afar_lies_on_the_floor_in_two_strengths(server, model):
    cells = [(3.0, 1.0, 1.0), (3.25, 1.0, 3.0), (3.5, 1.0, 3.5)]
    model.on_far_evidence(FarEvidenceCells(stamp_ns=1, cell_m=0.25, cells=cells))
    scene = _draw(server, model)
    strong = _node(server, "/far_evidence/strong")
    assert strong.vertices.shape == (8, 3)
    np.testing.assert_allclose(strong.vertices[:, :2].min(axis=0), [3.125, 0.875])
    np.testing.assert_allclose(strong.vertices[:, :2].max(axis=0), [3.625, 1.125])
    assert _node(server, "/far_evidence/faint").opacity < strong.opacity
    model.on_far_evidence(FarEvidenceCells(stamp_ns=2, cell_m=0.25, cells=cells[:1]))
    scene.draw(model, frozenset({"far_evidence"}), ViewOptions())
    assert _node(server, "/far_evidence/strong") is None
    scene.draw(model, frozenset(), ViewOptions(layers=frozenset(LAYERS) - {"far_evidence"}))
    assert _node(server, "/far_evidence/faint") is None


def test_every_layer_can_be_hidden(server, model, make):
    scene = _draw_everything(server, model, make)
    assert all(_node(server, name).visible for name in NODES.values())
    for layer, name in NODES.items():
        scene.draw(model, frozenset(), ViewOptions(layers=frozenset(LAYERS) - {layer}))
        assert not _node(server, name).visible, layer


NODES = {
    "map": "/map/0_0",
    "object": "/object_voxels",
    "tree": "/tree/nodes",
    "path": "/path/line",
    "camera": "/camera",
    "trail": "/trail/line",
    "finds": "/finds/0/label",
}


def _draw_everything(server, model, make):
    camera = PinholeCamera.from_horizontal_fov(64, 40, 1.2)
    model.on_camera(StampedCamera(stamp_ns=1, frame_id="optical", camera=camera))
    for n in range(60):
        T_world_base = base_pose(0.05 * n, 1.0, 0.0, 0.0)
        model.on_transforms(robot_transforms(n, T_world_base, ZED.T_base_camera(-0.3), "optical"))
    model.on_image(CompressedColor(stamp_ns=1, frame_id="optical", encoded=b"\xff\xd8picture"))
    model.on_path(StampedPath(stamp_ns=1, points_world=np.array([[0.0, 0, 0], [1, 1, 0]])))
    model.on_tree(_tree(5))
    model.on_status(make.status(find=make.find()))
    return _draw(server, model)


def test_a_long_trail_is_not_sent_again_with_every_step(server):
    layer = RobotLayer(server.scene)
    trail = [(0.05 * n, 0.0, 0.0) for n in range(2_000)]
    layer.draw_trail(trail, True)
    whole = _node(server, "/trail/line").points.copy()
    for n in range(2_000, 2_050):
        trail.append((0.05 * n, 0.0, 0.0))
        layer.draw_trail(trail, True)
    assert np.array_equal(_node(server, "/trail/line").points, whole)
    tail = _node(server, "/trail/tail")
    drawn = tail.points[..., 0]
    assert drawn.min() == pytest.approx(0.05 * 1_999)
    assert drawn.max() == pytest.approx(0.05 * 2_049)
    layer.draw_trail([(1.0, 0.05 * n, 0.0) for n in range(10)], True)
    assert len(_node(server, "/trail/line").points) == 9, "another trail"
    assert not tail.visible


def test_the_picture_travels_as_it_came(server, model, make):
    _draw_everything(server, model, make)
    frustum = _node(server, "/camera")
    assert frustum._image_data == b"\xff\xd8picture"
    assert frustum._format == "jpeg"


def test_likely_places_are_amber_and_the_find_is_green(make):
    report = make.find(position_world=(2.0, 2.0, 0.3))
    places = (
        FoundObject(label="hat", probability=0.9, center_world=(2.0, 2.1, 0.3), size_m=(1, 1, 1)),
        FoundObject(label="hat", probability=0.4, center_world=(5.0, 2.0, 0.3), size_m=(1, 1, 1)),
    )
    marks = marks_of(report, places)
    assert [(mark.text, mark.found) for mark in marks] == [("hat 90%", True), ("hat? 40%", False)]
    assert [mark.found for mark in marks_of(None, places)] == [False, False]


def test_what_was_found_before_keeps_its_box(make):
    two = GoalStatus(
        goal_id=1, object="chair", display="chairs", count=3, outcome="active",
        counted=[
            CountedFind(number=1, position_world=(1.0, 2.0, 0.4)),
            CountedFind(number=3, position_world=(3.0, 2.0, 0.4)),
        ],
    )  # fmt: skip
    marks = found_before(make.status(goal=two))
    assert [(mark.text, mark.center_world[0]) for mark in marks] == [
        ("chair 1", 1.0),
        ("chair 3", 3.0),
    ], "the second one was rejected"
    assert all(mark.found for mark in marks)
    done = msgspec.structs.replace(
        two, outcome="found", counted=two.counted[:1], find=3, position_world=(3.0, 2.0, 0.4)
    )
    assert [mark.text for mark in found_before(make.status(goal=done, find=None))] == [
        "chair 1",
        "chair 3",
    ]
    keys, hat = (
        GoalStatus(goal_id=n, object=name, outcome="found", position_world=(n, 0.0, 0.4))
        for n, name in ((2, "keys"), (3, "hat"))
    )
    status = make.status(goal=hat, tour=[keys, hat], find=make.find(goal_id=3))
    assert [mark.text for mark in found_before(status)] == ["keys"], "the hat is the present find"


def test_a_rejected_find_leaves_no_box(make):
    rejected = make.find(position_world=(2.0, 2.0, 0.3), size_m=(1.0, 2.0, 0.6))
    places = tuple(
        FoundObject(label="bed", probability=1.0, center_world=(x, 2.0, 0.3), size_m=(1, 1, 1))
        for x in (2.0, 2.9, 4.0)
    )
    marks = marks_of(None, places, (rejected,))
    assert [mark.center_world[0] for mark in marks] == [4.0]


def test_a_search_without_a_find_numbers_its_places(server, model, make):
    scene = _draw_everything(server, model, make)
    model.on_voxels(make.cloud([(30, 30, 2)], 9, ooi=254))
    model.on_status(make.status(state="exhausted"))
    scene.draw(model, model.take_changes(), ViewOptions())
    assert _node(server, "/finds/0/label").text == "1: 100%"
    np.testing.assert_allclose(
        _node(server, "/finds/0/label").position[:2], (3.05, 3.05), atol=1e-5
    )


def test_names_of_likely_places_leave_the_find_and_each_other_readable(make):
    report = make.find(position_world=(2.0, 2.0, 0.3), size_m=(2.0, 1.0, 0.5))
    places = tuple(
        FoundObject(label="hat", probability=p, center_world=(x, 2.0, 0.3), size_m=(1, 1, 1))
        for p, x in ((0.7, 2.9), (0.5, 5.4), (0.8, 5.0), (0.6, 6.5))
    )
    marks = marks_of(report, places)
    assert [mark.text for mark in marks] == ["hat 90%", "hat? 80%", "hat? 60%", ""]


def test_the_larger_the_map_the_farther_apart_are_names_of_likely_places(server, model, make):
    model.on_keyframe(make.cloud([(i, 0, 0) for i in range(120)]))
    two = GoalStatus(
        goal_id=1, object="hat", count=2, outcome="active",
        counted=[CountedFind(number=1, position_world=(1.0, 2.0, 0.3))],
    )  # fmt: skip
    model.on_status(make.status(goal=two))
    model.on_detections(
        tuple(
            FoundObject(label="hat", probability=p, center_world=(x, 2.0, 0.3), size_m=(1, 1, 1))
            for p, x in ((0.9, 2.5), (0.8, 5.0), (0.7, 6.5), (0.6, 9.0))
        )
    )
    _draw(server, model)
    names = [_node(server, f"/finds/{n}/label") for n in range(5)]
    assert [name.text for name in names if name.visible] == ["hat 1", "hat? 80%", "hat? 60%"]


def test_a_shrinking_tree_keeps_its_names(server, model, make):
    scene = _draw_everything(server, model, make)
    model.on_tree(_tree(2))
    scene.draw(model, model.take_changes(), ViewOptions())
    assert len(_node(server, "/tree/nodes").batched_positions) == 2
    assert len(_node(server, "/tree/edges").points) == 1
    model.on_tree(_tree(0))
    scene.draw(model, model.take_changes(), ViewOptions())
    assert not _node(server, "/tree/nodes").visible


def _tree(n):
    zeros = np.zeros(n, np.float32)
    return TreeView(
        positions_world=np.arange(3 * n, dtype=np.float32).reshape(n, 3),
        parents=np.arange(-1, n - 1, dtype=np.int32),
        yaws_rad=zeros,
        tilts_rad=zeros,
        gains=np.arange(n, dtype=np.float32),
        terminations=zeros,
        path_costs_s=zeros,
        levels=np.zeros(n, np.uint8),
        kinds=np.zeros(n, np.uint8),
    )


NAMES = ("wall", "floor", "bed", "sofa")
"""The voxels have label 3."""


def test_things_are_coloured_by_their_most_probable_kind(server, model, make):
    model.on_proximity(
        LevelTable(
            goal_id=1,
            object="hat",
            context="",
            provider="",
            elapsed_ms=0.0,
            rows=[LevelRow(label=name, level="far", reason="") for name in NAMES],
        )
    )
    scene = _draw(server, model, mode="thing", layers=frozenset({"map"}))
    assert model.label_colors.entries[0].text == "sofa"
    assert scene.voxels.kinds is model.label_colors.table
    first = tuple(model.label_colors.table[3].tolist())
    colors = _node(server, "/map/0_0").colors.astype(int)
    # Shading darkens colours and keeps their hue.
    share = colors / np.maximum(np.array(first), 1)
    assert np.ptp(share, axis=1).max() < 0.06


def test_a_robot_is_drawn_by_its_own_body(server, model):
    model.on_transforms(
        [
            StampedTransform(
                stamp_ns=1, parent="map", child="base_link", T_parent_child=base_pose(1, 2, 0, 0)
            )
        ]
    )
    scene = ViserScene(server)
    scene.draw(model, ALL_PARTS, ViewOptions())
    assert isinstance(_node(server, "/robot/base"), viser.CylinderHandle)
    reader = SceneReader(model)
    dog = dataclasses.replace(
        ZED,
        spheres=tuple(
            CollisionSphere(x_m=x, y_m=0.0, z_m=0.3, radius_m=0.2) for x in (-0.4, 0.0, 0.4)
        ),
    )
    config = NavigatorConfig(profile=dog)
    assert reader.feed(keys.CONFIGURATION, msgspec.json.encode(config))
    changed = model.take_changes()
    assert "pose" in changed
    scene.draw(model, changed, ViewOptions())
    body = _node(server, "/robot/base")
    assert isinstance(body, viser.MeshHandle)
    assert body.vertices.min(axis=0) == pytest.approx([-0.6, -0.2, 0.1], abs=0.01)
    assert body.vertices.max(axis=0) == pytest.approx([0.6, 0.2, 0.5], abs=0.01)
