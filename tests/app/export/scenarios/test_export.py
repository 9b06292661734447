"""What is exported, opened by programs that are not ours."""

import io
import json
import re
import shutil
import time
from pathlib import Path

import av
import msgspec
import numpy as np
import pytest
import trimesh
import viser
from PIL import Image
from pyarrow import csv

from app.cli.main import run
from app.export import report
from app.export.geometry import voxel_faces
from app.export.map_picture import MapFromAbove, extent_of
from app.export.session_data import need_map, read_session_data
from app.messages import keys
from app.messages.control import encode
from app.messages.status import CountedFind, GoalStatus
from app.recording.session_goals import SessionSearch
from app.recording.writing.writer import SessionWriter
from tests.app.recording.conftest import START_NS, status_of, write_session
from tests.chromium import PATIENCE_MS, new_page, open_browser


@pytest.fixture(scope="module")
def open3d():
    """The library, which takes a second to load: only who runs these tests waits for it."""
    import open3d

    return open3d


@pytest.fixture(scope="module")
def session(exported):
    session = read_session_data(exported.parent)
    yield session
    session.recording.close()


@pytest.mark.slow
def test_open3d_reads_the_points_with_their_colours(exported, session, open3d):
    cloud = open3d.io.read_point_cloud(str(exported / "map.ply"))
    indices, attributes, voxel_m = need_map(session)
    np.testing.assert_allclose(np.asarray(cloud.points), (indices + 0.5) * voxel_m, atol=1e-5)
    np.testing.assert_allclose(np.asarray(cloud.colors) * 255, attributes[:, :3], atol=0.6)


def test_viewers_read_the_faces_with_y_up_and_linear_colours(exported, session, open3d):
    mesh = open3d.io.read_triangle_mesh(str(exported / "map.glb"))
    indices, attributes, voxel_m = need_map(session)
    shown, srgb = np.asarray(mesh.vertex_colors), np.unique(attributes[:, :3]) / 255
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    np.testing.assert_allclose(np.unique(shown), np.unique(np.rint(255 * linear)) / 255, atol=1e-3)
    assert np.asarray(mesh.triangles).shape[0] > 2 * len(indices)
    x, y, z = np.stack([indices.min(axis=0), indices.max(axis=0) + 1], axis=1) * voxel_m
    expected = np.stack([x, z, -y[::-1]], axis=1)
    bounds = mesh.get_min_bound(), mesh.get_max_bound()
    np.testing.assert_allclose(bounds, expected, atol=1e-5)
    np.testing.assert_allclose(trimesh.load(exported / "map.glb").bounds, expected, atol=1e-5)


def test_faces_look_outwards(session):
    mesh = voxel_faces(session, "camera")
    indices, _, voxel_m = need_map(session)
    # One layer of voxels: each has a top and a bottom, and the rim its sides.
    up = mesh.face_normals[:, 2]
    assert np.count_nonzero(up > 0.5) == np.count_nonzero(up < -0.5) == 2 * len(indices)
    assert mesh.area == pytest.approx(
        (2 * len(indices) + np.count_nonzero(np.abs(up) < 0.5) / 2) * voxel_m**2
    )


def test_others_read_the_mesh_of_the_depth_images(exported, open3d):
    mesh = trimesh.load(exported / "mesh.ply", process=False)
    assert len(mesh.faces) > 100
    assert np.asarray(open3d.io.read_triangle_mesh(str(exported / "mesh.ply")).vertices).shape == (
        mesh.vertices.shape
    )
    # A wall two metres before a camera that goes forward by 0.58 m and looks 0.3 rad down.
    assert mesh.vertices[:, 0].min() > 1.0
    assert mesh.vertices[:, 0].max() < 3.6
    # The pictures are grey, of all shades.
    shades = mesh.visual.vertex_colors[:, :3]
    assert (np.ptp(shades.astype(int), axis=1) <= 2).all()


def test_the_map_from_above_follows_voxels_that_come_and_go(session):
    indices, attributes, voxel_m = need_map(session)
    frame = extent_of(indices, voxel_m, 300)
    above = MapFromAbove(indices, voxel_m, frame, floor_z_m=0.0)
    empty = np.asarray(above.image())
    above.take(indices, attributes)
    whole = np.asarray(above.image())
    higher = indices[:10] + np.array([0, 0, 1])
    red = np.full((10, 8), [255, 0, 0, 0, 0, 0, 0, 0], np.uint8)
    taller = MapFromAbove(np.concatenate([indices, higher]), voxel_m, frame, floor_z_m=0.0)
    taller.take(indices, attributes)
    np.testing.assert_array_equal(taller.image(), whole)
    taller.take(higher, red)
    assert (np.asarray(taller.image()) != whole).any()
    taller.take(higher, red, np.zeros(10, bool))
    np.testing.assert_array_equal(taller.image(), whole)
    taller.clear()
    np.testing.assert_array_equal(taller.image(), empty)


def test_colours_by_probability_differ_from_the_camera_s(exported, tmp_path, open3d):
    assert (
        run(["export", str(exported.parent), "ply", "--color", "ooi", "--out", str(tmp_path)]) == 0
    )
    by_ooi = open3d.io.read_point_cloud(str(tmp_path / "map.ply"))
    by_camera = open3d.io.read_point_cloud(str(exported / "map.ply"))
    assert not np.allclose(np.asarray(by_ooi.colors), np.asarray(by_camera.colors))


def test_trajectories_read_as_numbers(exported, session):
    tum = np.loadtxt(exported / "trajectory.tum")
    trajectory = session.trajectory
    np.testing.assert_allclose(tum[:, 1:4], trajectory.T_world_base[:, :3, 3], atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(tum[:, 4:], axis=1), 1.0, atol=1e-5)
    table = csv.read_csv(exported / "trajectory.csv").to_pydict()
    np.testing.assert_allclose(table["time_s"], tum[:, 0], atol=1e-6)
    assert table["driven_m"][-1] == pytest.approx(0.02 * 29, abs=1e-3)


def test_finds_as_json(exported):
    finds = json.loads((exported / "finds.json").read_text())
    assert finds["find"]["object"] == "hat"
    assert finds["goals"][-1]["outcome"] == "found"
    assert finds["detections"][0]["label"] == "hat"


def test_videos_play_at_the_session_s_speed(exported):
    with av.open(str(exported / "camera.mp4")) as video:
        frames = list(video.decode(video=0))
    assert len(frames) == 30
    assert frames[-1].time - frames[0].time == pytest.approx(5.8, abs=0.01)
    brightness = [frame.to_ndarray(format="gray").mean() for frame in frames]
    np.testing.assert_allclose(brightness, [(n * 5) % 256 for n in range(30)], atol=6)
    with av.open(str(exported / "map.mp4")) as video:
        drawn = [frame.to_ndarray(format="gray") for frame in video.decode(video=0)]
    assert len(drawn) == 25
    assert (drawn[-1] > 40).mean() > 2 * (drawn[2] > 40).mean()


def test_the_report_says_it_all_and_needs_nothing_else(exported):
    page = (exported / "report.html").read_text()
    for text in (
        "Search for hat: found",
        "on the sofa",
        "SPL",
        "0.71",
        "searching for hat",
        "<svg",
    ):
        assert text in page
    assert page.count("data:image/png") == 3
    assert page.count("data:image/jpeg") >= 4
    assert re.findall(r'(?:src|href)="(?!data:)', page) == []


def test_several_sessions_in_one_report_in_german(exported, tmp_path, capsys):
    folder = tmp_path / "sessions"
    for name in ("a", "b"):
        shutil.copytree(exported.parent, folder / name, ignore=lambda *_: ["export"])
    assert run(["export", str(folder), "report", "--language", "de"]) == 0
    page = (folder / "export" / "report.html").read_text()
    assert "<h1>2 Sitzungen: 2 von 2 Gegenständen gefunden</h1>" in page
    assert page.count("<h1>Suche nach „Hut“: gefunden</h1>") == 2
    assert "sucht „Hut“" in page
    assert page.count("data:image/png") == 6
    (folder / "c.mcap").write_bytes(b"nonsense")
    out = str(tmp_path / "out")
    both = ["export", str(folder / "a"), str(folder / "c.mcap"), "report", "--out", out]
    assert run(both) == 1
    assert "skipped: " in capsys.readouterr().out
    assert "Search for hat: found" in (tmp_path / "out" / "report.html").read_text()
    assert run(["export", str(folder / "a"), str(folder / "b"), "ply"]) == 2
    assert "fit into a report only" in capsys.readouterr().err


def test_a_report_of_several_searches_names_each_and_sums_them(tmp_path):
    session = write_session(tmp_path, end=False)
    ended = status_of(30, "found")
    cups = GoalStatus(goal_id=2, object="cup", display="cups", outcome="active", count="all")
    after = msgspec.structs.replace(ended, goal=cups, history=[ended.goal], path_length_m=1.0)
    session.add(keys.STATUS, encode(after), START_NS + 7 * 10**9, 7.0)
    session.close()
    assert run(["export", str(session.writer.folder), "report"]) == 0
    page = (session.writer.folder / "export" / "report.html").read_text()
    assert "<h1>2 searches: 1 found</h1>" in page
    assert "<td>hat</td><td>on the sofa</td><td>found, not confirmed</td>" in page
    assert "<td>cups</td><td></td><td>unfinished, all: 0 found</td>" in page
    assert "<dt>Path</dt><dd>1.5 m</dd>" in page


def test_the_map_of_a_report_marks_the_finds_of_every_search(session, monkeypatch):
    drawn = []

    def draw(scene, frame, mode, found):
        drawn.append((mode, found))
        return np.zeros((2, 2, 3), np.uint8)

    places = [(0.5, 0.5, 0.2), (0.2, 0.4, 0.6), (0.9, 0.1, 0.4)]
    chair = CountedFind(number=1, position_world=places[1])
    goals = [
        GoalStatus(goal_id=1, object="hat", outcome="found", position_world=places[0], tour=1),
        GoalStatus(goal_id=2, object="keys", outcome="exhausted", tour=1),
        GoalStatus(goal_id=3, object="chair", position_world=places[2], counted=[chair], count=2),
    ]
    monkeypatch.setattr(report, "draw_map", draw)
    searches = [SessionSearch(goal=goal, parts=((0, goal.goal_id),)) for goal in goals]
    monkeypatch.setattr(report, "searches_of", lambda _: searches)
    report.part_of(session)
    assert drawn == [(mode, places) for mode in ("camera", "ooi", "proximity")]


@pytest.mark.browser
def test_a_browser_opens_the_report_and_the_scene(exported):
    file = "http://viser.test/scene.viser"
    client = Path(viser.__file__).parent / "client" / "build" / "index.html"
    with open_browser() as browser:
        page = new_page(browser, 1280)
        page.goto((exported / "report.html").as_uri())
        loaded = page.evaluate("[...document.images].every((i) => i.naturalWidth > 0)")
        assert loaded
        assert page.locator("polyline").count() == 4
        page.goto((exported / "scene.html").as_uri())
        _await_scene(page)
        # viser's own player of its files, as its documentation has it served.
        page.route(re.compile(r"viser\.test/\?"), lambda route: route.fulfill(path=client))
        page.route(file, lambda route: route.fulfill(path=exported / "scene.viser"))
        page.goto(f"http://viser.test/?playbackPath={file}")
        _await_scene(page)


def _await_scene(page):
    """Wait until viser's client has drawn more than an empty ground."""
    deadline = time.monotonic() + PATIENCE_MS / 1e3
    while True:
        shot = page.locator("canvas").first.screenshot()
        colors = Image.open(io.BytesIO(shot)).convert("RGB").getcolors(1 << 24)
        if len(colors) > 200:
            return
        assert time.monotonic() < deadline, f"{len(colors)} colours are no scene"
        page.wait_for_timeout(500)


def test_what_is_not_there_is_said_and_the_rest_is_written(tmp_path, capsys):
    writer = SessionWriter(tmp_path / "s", "r")
    writer.add("status", b"{}", 1, 0.0)
    writer.close()
    assert run(["export", str(tmp_path / "s"), "ply", "mesh", "tum", "camera", "report"]) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert "has no map" in said
    assert "no pose of the robot" in said
    assert "no picture of a camera" in said
    assert "no depth image with colour and pose" in said
    assert "No map was recorded" in (tmp_path / "s" / "export" / "report.html").read_text()


def test_unknown_exports_and_recordings_are_usage_errors(tmp_path, capsys):
    assert run(["export", str(tmp_path / "none.mcap")]) == 2
    assert "there is no" in capsys.readouterr().err
    assert run(["export", str(tmp_path), "obj"]) == 2
    assert "there are ply, glb" in capsys.readouterr().err.replace("\n", " ")
