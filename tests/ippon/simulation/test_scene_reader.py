import json
import struct
from pathlib import Path

import numpy as np
import pytest
import trimesh

from ippon.errors import SceneError
from ippon.simulation.scene_reader import load_scene
from ippon.simulation.scene_writer import save_scene
from tests.locations import SHARED

SCENES = SHARED / "scenes"


def _write(folder: Path, *, nodes=("chair.0",), instances=None, box=(1.0, 2.0, 0.5)) -> Path:
    graph = trimesh.Scene()
    mesh = trimesh.creation.box(box)
    for k, node in enumerate(nodes):
        transform = np.eye(4)
        transform[:3, 3] = (3.0 * k, 0.0, 0.25)
        graph.add_geometry(mesh, node_name=node, geom_name="shared", transform=transform)
    folder.mkdir(exist_ok=True)
    (folder / "scene.glb").write_bytes(graph.export(file_type="glb"))
    entries = [
        {
            "node": node,
            "category": node.split(".")[0],
            "label": "thing",
            "aabb_min": [3.0 * k - 0.5, -1.0, 0.0],
            "aabb_max": [3.0 * k + 0.5, 1.0, 0.5],
        }
        for k, node in enumerate(nodes)
    ]
    description = {
        "name": "one",
        "source": "made here",
        "licence": "MIT",
        "up": "z",
        "units": "m",
        "instances": entries if instances is None else instances,
        "start_poses": [{"x": 0, "y": 3, "z": 0, "yaw": 1.5}],
        "rooms": [{"name": "hall.0", "polygon": [[0, 0], [0, 4], [4, 4], [4, 0]]}],
    }
    (folder / "scene.json").write_text(json.dumps(description))
    return folder


def _change(folder: Path, change) -> Path:
    path = folder / "scene.json"
    description = json.loads(path.read_text())
    change(description)
    path.write_text(json.dumps(description))
    return folder


def test_node_transforms_are_applied_to_a_shared_mesh_without_rotation(tmp_path):
    scene = load_scene(_write(tmp_path, nodes=("chair.0", "bed.0")))
    np.testing.assert_allclose(scene.instances[1].aabb_min, (2.5, -1.0, 0.0), atol=1e-6)
    np.testing.assert_allclose(scene.instances[1].aabb_max, (3.5, 1.0, 0.5), atol=1e-6)
    assert scene.faces.shape == (24, 3)
    assert scene.face_instance.tolist() == [0] * 12 + [1] * 12
    assert scene.vertices.dtype == np.float32
    assert scene.source == "made here; licence: MIT"


def test_room_corners_are_counter_clockwise(tmp_path):
    polygon = load_scene(_write(tmp_path)).rooms[0].polygon
    x, y = polygon.T
    assert np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) == pytest.approx(32.0)


def test_the_habitat_name_of_the_tv_becomes_the_common_one(tmp_path):
    assert load_scene(_write(tmp_path, nodes=("tv_monitor.0",))).instances[0].category == "tv"


def test_missing_folder_and_files_are_named(tmp_path):
    with pytest.raises(SceneError, match="there is no scene folder"):
        load_scene(tmp_path / "nowhere")
    with pytest.raises(SceneError, match=r"scene\.glb is missing"):
        load_scene(tmp_path)
    folder = _write(tmp_path / "a")
    (folder / "scene.json").unlink()
    with pytest.raises(SceneError, match=r"scene\.json is missing"):
        load_scene(folder)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda d: d.update(up="y"), "up is 'y'"),
        (lambda d: d.update(units="cm"), "units is 'cm'"),
        (lambda d: d.update(instances=[]), "no instances"),
        (lambda d: d.update(instances="all"), "must be a list"),
        (lambda d: d.update(start_poses=[]), "no start poses"),
        (lambda d: d["start_poses"][0].update(x="left"), "4 finite numbers"),
        (lambda d: d["start_poses"][0].update(yaw=float("nan")), "4 finite numbers"),
        (lambda d: d["start_poses"][0].update(x=10**400), "4 finite numbers"),
        (lambda d: d["instances"][0].update(category="throne"), "'throne'.*40 Matterport"),
        (lambda d: d["instances"][0].pop("node"), "no `node` name"),
        (lambda d: d["instances"].append(d["instances"][0]), "twice"),
        (lambda d: d["instances"][0].update(node="chair.9"), "lists nodes that.*chair.9"),
        (lambda d: d["instances"][0].update(aabb_max=[9, 9, 9]), "z up in metres"),
        (lambda d: d["instances"][0].update(aabb_max=None), "3 finite numbers"),
        (lambda d: d["rooms"][0].update(polygon=[[0, 0]]), "3 corners"),
    ],
)
def test_errors_of_the_description_are_named(tmp_path, change, text):
    folder = _change(_write(tmp_path), change)
    with pytest.raises(SceneError, match=text):
        load_scene(folder)


def test_a_node_without_instance_is_refused(tmp_path):
    folder = _write(tmp_path, nodes=("chair.0", "bed.0"))
    _change(folder, lambda d: d["instances"].pop())
    with pytest.raises(SceneError, match=r"scene.json lacks: bed.0"):
        load_scene(folder)


def test_text_that_is_not_json_is_refused(tmp_path):
    folder = _write(tmp_path)
    (folder / "scene.json").write_text("{")
    with pytest.raises(SceneError, match="is not JSON"):
        load_scene(folder)
    (folder / "scene.json").write_text("[]")
    with pytest.raises(SceneError, match="must hold an object"):
        load_scene(folder)


@pytest.mark.parametrize("keep", [0, 3, 11, 20, 0.1, 0.3, 0.5, 0.8, 0.95, 0.999])
def test_a_truncated_glb_is_refused(tmp_path, keep):
    folder = _write(tmp_path)
    data = (folder / "scene.glb").read_bytes()
    count = int(keep * len(data)) if isinstance(keep, float) else keep
    (folder / "scene.glb").write_bytes(data[:count])
    with pytest.raises(SceneError):
        load_scene(folder)


def test_vertices_that_are_not_numbers_are_refused(tmp_path):
    folder = _write(tmp_path)
    data = (folder / "scene.glb").read_bytes()
    (folder / "scene.glb").write_bytes(
        data.replace(struct.pack("<f", 1.0), struct.pack("<f", float("nan")))
    )
    with pytest.raises(SceneError, match="not finite"):
        load_scene(folder)


@pytest.mark.slow
@pytest.mark.skipif(not SCENES.is_dir(), reason="the shared scenes are not beside the repository")
@pytest.mark.parametrize("name", ["sh3d_studio", "procthor_d01", "aws_small_house"])
def test_shared_scenes_load_and_survive_a_round_trip(tmp_path, name):
    scene = load_scene(SCENES / name)
    assert len(scene.faces) == len(scene.face_instance)
    assert set(np.unique(scene.face_instance)) == set(range(len(scene.instances)))
    assert scene.face_texture is not None
    assert scene.face_texture.max() < len(scene.textures)
    save_scene(scene, tmp_path / name)
    again = load_scene(tmp_path / name)
    assert again.name == scene.name
    assert again.source == scene.source
    assert [i.node for i in again.instances] == [i.node for i in scene.instances]
    np.testing.assert_allclose(again.vertices[again.faces], scene.vertices[scene.faces], atol=1e-5)
    np.testing.assert_array_equal(again.face_texture, scene.face_texture)
    np.testing.assert_array_equal(again.face_colors, scene.face_colors)
