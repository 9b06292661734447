import numpy as np
import simplejpeg

from app.messages.images import decompress_color
from app.nodes.console.scene.find_picture import crop, outlined
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
