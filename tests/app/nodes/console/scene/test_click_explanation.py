"""A click on the model explains what is there; a click as a command goes out where it came in."""

from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
import simplejpeg

from app.messages.control import InspectReply, LabelShare
from app.messages.images import CompressedColor, StampedCamera
from app.messages.motion import robot_transforms
from app.nodes.console.link.commands import CommandError
from app.nodes.console.panels import markup
from app.nodes.console.panels.drive_markup import intervention
from app.nodes.console.scene.click_explanation import (
    ExplanationBuilder,
    marked,
    of_thing,
    with_labels,
)
from app.nodes.console.scene.clicks import Clicks
from app.view.model.picture_store import StoredPicture
from app.view.model.scene_model import SceneModel
from app.view.words import ENGLISH, Words
from ippon.camera import PinholeCamera
from ippon.geometry import base_pose
from ippon.robot import ZED

CAMERA = PinholeCamera(width=160, height=100, fx=106.0, fy=106.0, cx=80.0, cy=50.0)
DOWN = np.array([0.0, 0.0, -1.0])


@pytest.fixture
def model(stage):
    model = SceneModel()
    model.on_status(stage.status_of())
    indices, labels = stage.home_voxels()
    model.on_keyframe(stage.cloud_of(indices, labels, 1))
    model.on_tree(stage.tree_of(np.random.default_rng(3)))
    model.on_camera(StampedCamera(stamp_ns=1, frame_id="camera", camera=CAMERA))
    stands = base_pose(2.0, 2.0, 0.0, 1.57)
    model.on_transforms(robot_transforms(1, stands, ZED.T_base_camera(-0.3), "camera"))
    grey = np.full((100, 160, 3), 128, np.uint8)
    model.on_image(CompressedColor(stamp_ns=1, frame_id="camera", encoded=_jpeg(grey)))
    model.take_changes()
    return model


def _jpeg(image) -> bytes:
    return simplejpeg.encode_jpeg(image, quality=90, colorspace="RGB")


def test_a_surface_is_explained_with_the_picture_that_shows_it(model):
    shown: dict[str, bytes] = {}
    explanations = ExplanationBuilder(model, shown.__setitem__)
    # The sofa stands 3 m ahead of the camera.
    explanation, highlight, voxel = explanations.explain(np.array([2.05, 5.05, 3.0]), DOWN, 1.4)
    assert voxel == pytest.approx((2.05, 5.05, 0.35))
    assert highlight.at == voxel
    assert [picture.caption for picture in explanation.pictures] == ["from 3.2 m"]
    assert shown[explanation.pictures[0].name].startswith(b"\xff\xd8")

    reply = InspectReply(
        labels=[
            LabelShare(label="sofa", probability=0.8),
            LabelShare(label="bed", probability=0.1),
        ],
        ooi=0.25,
        level="certain",
    )
    full = with_labels(explanation, reply, "hat", ENGLISH)
    assert full.title == "Sofa"
    assert full.rows[:4] == [
        ("hat", "25.0%"),
        ("sofa", "80.0%"),
        ("bed", "10.0%"),
        ("Level", "certain"),
    ]
    german = with_labels(explanation, reply, "Hut", Words("de"))
    assert german.title == "Sofa"
    assert german.rows[1:4] == [
        ("Sofa", "80,0\u00a0%"),
        ("Bett", "10,0\u00a0%"),
        ("Stufe", "sicher"),
    ]


def test_a_remembered_thing_stays_what_it_is_when_its_surface_is_called_something_else(model):
    explanations = ExplanationBuilder(model, lambda *_: None)
    surface, _, _ = explanations.explain(np.array([2.05, 5.05, 3.0]), DOWN, 1.4)
    reply = InspectReply(
        labels=[
            LabelShare(label="clothes", probability=0.9),
            LabelShare(label="hat", probability=0.1),
        ],
        ooi=0.0,
        level=None,
    )
    full = with_labels(of_thing(surface, "hat", 0.99, ENGLISH), reply, "plant", ENGLISH)
    assert full.title == "Hat"
    assert full.rows[:3] == [("hat", "99.0%"), ("plant", "0.0%"), ("clothes", "90.0%")]
    named = with_labels(of_thing(surface, "Anna's mug", None, ENGLISH), reply, "", ENGLISH)
    assert named.title == "Anna's mug"
    assert named.rows[:2] == [("clothes", "90.0%"), ("hat", "10.0%")]
    assert of_thing(surface, "", None, ENGLISH) is surface
    assert of_thing(surface, "TV-Bank", None, ENGLISH).title == "TV-Bank"


def test_a_bead_is_explained_by_gain_cost_level_and_what_it_sees(model):
    explanations = ExplanationBuilder(model, lambda *_: None)
    x, y, _ = model.tree.positions_world[5]
    explanation, highlight, voxel = explanations.explain(np.array([x, y, 3.0]), DOWN, 1.4)
    assert voxel is None
    assert explanation.title.startswith("Viewpoint: ")
    assert [name for name, _ in explanation.rows][:4] == [
        "Gain",
        "Cost",
        "Gain per second",
        "Level",
    ]
    assert len(highlight.seen) > 50


def test_a_click_beside_everything_says_what_would_do(model):
    explanations = ExplanationBuilder(model, lambda *_: None)
    explanation, _, voxel = explanations.explain(np.array([500.0, 0.0, 3.0]), DOWN, None)
    assert (explanation.title, voxel) == ("Nothing there", None)
    assert explanation.note == "Click a surface of the map, or the sphere of a viewpoint."
    empty, _, _ = ExplanationBuilder(SceneModel(), lambda *_: None).explain(np.zeros(3), DOWN, None)
    assert empty.note == "The map is empty."


def test_a_picture_that_cannot_be_read_is_shown_as_it_came():
    picture = StoredPicture(
        number=0, stamp_ns=0, encoded=b"no picture", camera=CAMERA, T_world_camera=np.eye(4)
    )
    assert marked(picture, 5, 5) == b"no picture"


CLIENT = 7


class Panel:
    """Stands in for the Drive tab."""

    said = ""

    def attempt(self, command) -> None:
        try:
            self.said = command()
        except CommandError as error:
            self.said = f"refused: {error}"


def _click(tool, origin=(1.0, 2.0, 3.0), direction=(0.0, 0.0, -1.0), client=CLIENT, floor_z_m=0.0):
    clicks, said = _clicks(tool, floor_z_m)
    clicks._clicked(SimpleNamespace(ray_origin=origin, ray_direction=direction, client_id=client))
    return said(), clicks.questions()


def _clicks(tool, floor_z_m=0.0):
    """Return clicks with a tool, and what tells what was said to the operator."""
    scene = SimpleNamespace(on_click=lambda: id, on_rect_select=lambda **_: id)
    actions: Any = SimpleNamespace(
        say=ENGLISH,
        go_to=lambda x, y: f"to {x:g} {y:g}",
        paint=lambda wish, strokes, radius: f"{wish} {strokes} {radius}",
    )
    panel: Any = Panel()
    tools: Any = {CLIENT: SimpleNamespace(chosen=tool, brush_m=0.5)}
    clicks = Clicks(SimpleNamespace(scene=scene), panel, tools.get, actions, lambda: floor_z_m)
    return clicks, lambda: panel.said


def _drag(tool, low=(0.5, 0.25), high=(0.75, 0.5), height_m=4.0, floor_z_m=0.0):
    """Drag a rectangle with Shift, over a camera that looks straight down."""
    camera = SimpleNamespace(
        position=(2.0, 3.0, height_m), wxyz=(0.0, 1.0, 0.0, 0.0), fov=0.5 * np.pi, aspect=1.0
    )
    clicks, said = _clicks(tool, floor_z_m)
    panel: Any = clicks._panel
    client = SimpleNamespace(camera=camera)
    event = SimpleNamespace(client=client, client_id=CLIENT, screen_min=low, screen_max=high)
    clicks._dragged(panel, event)
    return said()


def test_what_a_click_does_is_what_the_tab_says():
    assert _click("go") == ("to 1 2", [])
    assert _click("look_here")[0] == "look_here [(1.0, 2.0)] 0.5"
    assert _click("not_here")[0] == "not_here [(1.0, 2.0)] 0.5"
    said, questions = _click("explain")
    assert said == ""
    assert [client for _, _, client in questions] == [CLIENT]


def test_a_click_of_a_browser_that_chose_nothing_explains():
    said, questions = _click("go", client=CLIENT + 1)
    assert (said, len(questions)) == ("", 1)


def test_a_drag_paints_a_region_and_nothing_else():
    assert _drag("look_here").startswith("look_here [(2.")
    assert _drag("not_here").count("(") > 100
    assert _drag("explain").startswith("refused: Choose Look here or Not here first")
    assert _drag("go").startswith("refused: Choose")
    assert "not on the floor" in _drag("look_here", height_m=-1.0)


@pytest.mark.parametrize("floor_z_m", [3.0, -1.3])
def test_a_click_or_drag_is_on_the_floor_of_the_robot(floor_z_m):
    eye = (0.0, 2.0, floor_z_m + 4.0)
    assert _click("go", eye, (0.5, 0.0, -1.0), floor_z_m=floor_z_m)[0] == "to 2 2"
    lifted = _drag("not_here", height_m=floor_z_m + 4.0, floor_z_m=floor_z_m)
    assert lifted == _drag("not_here")


@pytest.mark.parametrize("layers", [30, -13])
def test_what_is_cut_above_another_floor_is_not_explained(stage, layers):
    model = SceneModel()
    model.on_status(stage.status_of())
    indices = np.array([(20, 50, 3), (20, 50, 18)]) + np.array([0, 0, layers])
    model.on_keyframe(stage.cloud_of(indices, np.zeros(2, np.uint8), 1))
    stands = base_pose(2.0, 2.0, 0.1 * layers, 0.0)
    model.on_transforms(robot_transforms(1, stands, ZED.T_base_camera(-0.3), "camera"))
    explanations = ExplanationBuilder(model, lambda *_: None)
    above = np.array([2.05, 5.05, 0.1 * layers + 3.0])
    _, _, voxel = explanations.explain(above, DOWN, 1.4)
    assert voxel == pytest.approx((2.05, 5.05, 0.1 * layers + 0.35))


def test_a_click_off_the_floor_or_without_a_ray_commands_nothing():
    said, _ = _click("go", direction=(0.0, 0.0, 1.0))
    assert said == "refused: the click is not on the floor; tilt the view down"
    assert _click("go", direction=(float("nan"), 0.0, 1.0)) == ("", [])
    assert _click("explain", origin=None) == ("", [])


def test_what_the_filter_says_is_escaped(stage):
    drive = stage.status_of().drive
    assert intervention(drive, ENGLISH) == ""
    hostile = msgspec.structs.replace(drive, intervention="<img onerror=x>")
    assert "<img" not in intervention(hostile, ENGLISH)
    assert "&lt;img" in markup.choice("auto", "<img>")
