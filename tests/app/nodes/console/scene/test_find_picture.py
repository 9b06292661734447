import numpy as np
import pytest
import simplejpeg
from msgspec.structs import replace

from app.messages.images import CompressedColor, decompress_color
from app.messages.status import GoalStatus
from app.nodes.console.scene import find_picture
from app.nodes.console.scene.find_picture import FindPictures, crop, outlined
from app.view.colors import FOUND
from app.view.model.picture_store import StoredPicture
from app.view.model.voxel_pictures import VoxelPicture
from ippon.camera import PinholeCamera


def _jpeg():
    return simplejpeg.encode_jpeg(np.full((100, 160, 3), 200, np.uint8), quality=95)


def test_the_object_is_framed_in_green_and_the_rest_dimmed():
    image = decompress_color(outlined(_jpeg(), (40, 30, 80, 60))).astype(int)
    assert image.shape == (100, 160, 3)
    assert abs(image[45, 60] - 200).max() < 12
    assert abs(image[5, 5] - 100).max() < 12
    assert np.abs(image[28, 60] - FOUND).max() < 60


def test_a_box_beyond_the_picture_is_cut():
    image = decompress_color(outlined(_jpeg(), (-50, -50, 900, 900)))
    assert image.shape == (100, 160, 3)
    assert abs(image[50, 80].astype(int) - 200).max() < 12


def test_without_a_box_or_a_readable_picture_nothing_is_changed():
    jpeg = _jpeg()
    assert outlined(jpeg, None) is jpeg
    assert outlined(b"broken", (1, 1, 5, 5)) == b"broken"


def _seen(encoded, u, v, depth_m):
    picture = StoredPicture(
        number=1,
        stamp_ns=1,
        encoded=encoded,
        camera=PinholeCamera(width=160, height=100, fx=80.0, fy=80.0, cx=80.0, cy=50.0),
        T_world_camera=np.eye(4),
    )
    return VoxelPicture(picture=picture, u=u, v=v, depth_m=depth_m)


def test_a_crop_shows_as_much_of_the_place_from_near_and_far():
    assert decompress_color(crop(_seen(_jpeg(), 80, 50, 1.4))).shape == (60, 80, 3)
    assert decompress_color(crop(_seen(_jpeg(), 80, 50, 4.0))).shape == (36, 48, 3)
    assert decompress_color(crop(_seen(_jpeg(), 2, 99, 2.0))).shape == (42, 56, 3)
    assert decompress_color(crop(_seen(_jpeg(), 80, 50, 0.1))).shape == (100, 160, 3)
    assert crop(_seen(b"broken", 80, 50, 1.0)) is None


@pytest.fixture
def plain(monkeypatch):
    """Leave out the frame around the object."""
    monkeypatch.setattr(find_picture, "outlined", lambda encoded, _: encoded)


def status_at(stage, elapsed_s):
    """Return the status of a tour in which goal 1 was found after 20 s."""
    found = GoalStatus(goal_id=1, object="tv", outcome="found", took_s=20.0, tour=1)
    lead = GoalStatus(goal_id=2, object="chair", outcome="active", tour=1)
    return stage.status_of(goal=lead, tour=[found, lead], elapsed_s=elapsed_s)


def image_of(encoded, stamp_ns=0):
    return CompressedColor(stamp_ns=stamp_ns, frame_id="camera", encoded=encoded)


def test_a_find_that_waits_is_not_shown_in_an_image_of_later(stage, plain):
    goal = GoalStatus(goal_id=1, object="hat", outcome="found", took_s=20.0)
    status = stage.status_of("found", goal=goal, elapsed_s=20.0)
    find, pictures = replace(stage.find_of(), stamp_ns=20_000_000_000), FindPictures()
    assert pictures.picture_of(find, status, image_of(b"wall", 80_000_000_000)) is None
    assert pictures.picture_of(find, status, image_of(b"hat", 20_200_000_000)) == b"hat"
    assert pictures.picture_of(find, status, image_of(b"wall", 80_000_000_000)) == b"hat"


def test_an_earlier_find_of_a_tour_keeps_its_own_picture(stage, plain):
    pictures, first = FindPictures(), stage.find_of()
    second = replace(first, goal_id=2, position_world=(1.0, 2.0, 0.5))
    assert pictures.picture_of(first, status_at(stage, 20.2), image_of(b"tv")) == b"tv"
    assert pictures.picture_of(second, status_at(stage, 54.0), image_of(b"chair")) == b"chair"
    assert pictures.picture_of(first, status_at(stage, 54.0), image_of(b"chair")) == b"tv"


def test_a_find_that_the_search_went_on_from_is_not_shown_in_the_present_image(stage, plain):
    status, image = status_at(stage, 54.0), image_of(b"chair")
    assert FindPictures().picture_of(stage.find_of(), status, image) is None


def test_only_the_latest_pictures_are_kept(stage, plain):
    pictures, find = FindPictures(), stage.find_of()
    for number in range(find_picture._KEPT + 2):
        pictures.picture_of(replace(find, number=number), status_at(stage, 20.0), image_of(b"old"))
    again = pictures.picture_of(replace(find, number=0), status_at(stage, 20.0), image_of(b"new"))
    assert again == b"new"
