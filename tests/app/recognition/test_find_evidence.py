"""Places in words, and the images that are chosen of a find."""

import pickle
from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_matrix

from app.recognition.find_evidence import Sighting, _best, _direction, _frame_of, places_of_voxel
from app.recognition.views import View
from ippon.calibration.evidence import Evidence, EvidenceCollector
from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import R_BASE_CAMERA_LEVEL, invert_transform, make_transform, rotation_z
from ippon.mapping.objects.places import place_of
from ippon.observation import Detections, Instance
from ippon.segmentation.instance_heatmap import heatmap_of_instances

CAMERA = PinholeCamera(width=80, height=60, fx=70.0, fy=70.0, cx=39.5, cy=29.5)


def view(number, *, yaw=0.0, score=0.9, box=(10.0, 10.0, 60.0, 50.0)):
    cup = Instance(label="cup", score=score, box_px=box)
    return View(
        number=number,
        T_camera_world=invert_transform(
            make_transform(rotation_z(yaw) @ R_BASE_CAMERA_LEVEL, np.zeros(3))
        ),
        camera=CAMERA,
        depth=np.full((60, 80), 2.0, np.float16),
        detections=Detections(
            source="x", labels=("cup",), ooi=None, image_size=(60, 80), instances=(cup,)
        ),
        masks=(None,),
    )


@pytest.mark.parametrize("degrees", range(8, 360, 15))
@pytest.mark.parametrize("distance_m", [1.0, 3.0])
def test_a_place_is_named_by_its_direction(degrees, distance_m):
    a = np.radians(degrees)
    text = _direction(place_of(distance_m * np.cos(a), distance_m * np.sin(a), 0.1))
    named = float(text.removeprefix("from ").split("°")[0])
    assert abs(named - degrees) <= 8.0
    assert text.endswith("farther than 2 m" if distance_m > 2.0 else "nearer than 2 m")


def test_steep_places():
    assert _direction(place_of(0.0, 0.0, 1.0)) == "from above, nearer than 2 m"
    assert _direction(place_of(0.0, 0.1, -3.0)) == "from below, farther than 2 m"


def test_a_view_shows_what_is_in_view_recognised_and_not_covered():
    assert view(0).shows("cup", (2.0, 0.0, 0.0))
    assert not view(0).shows("hat", (2.0, 0.0, 0.0))
    assert not view(0).shows("cup", (-2.0, 0.0, 0.0)), "behind the camera"
    assert not view(0).shows("cup", (3.0, 0.0, 0.0)), "covered by what is 2 m away"
    assert view(0, score=0.2).shows("cup", (2.0, 0.0, 0.0)) is False
    assert view(0, box=(0.0, 0.0, 5.0, 5.0)).shows("cup", (2.0, 0.0, 0.0)) is False


def test_a_view_that_shows_a_thing_badly_says_nothing_of_it():
    elsewhere = view(0, box=(0.0, 0.0, 5.0, 5.0))
    assert elsewhere.shows("hat", (2.0, 0.0, 0.0)) is None, "it was not looked for"
    assert elsewhere.shows("cup", (3.0, 0.0, 0.0)) is None, "covered"
    assert elsewhere.shows("cup", (2.0, -1.1, 0.0)) is None, "at the border"
    far = replace(elsewhere, depth=np.full((60, 80), 4.0, np.float16))
    assert far.shows("cup", (4.0, 0.0, 0.0)) is None


def test_images_from_different_places_come_first():
    def sighting(number, yaw, score):
        one = view(number, yaw=yaw, score=score)
        return Sighting(
            view=one, pixel=(40.0, 30.0), distance_m=2.0, instance=one.detections.instances[0]
        )

    seen = [sighting(n, 0.01 * n, 0.9) for n in range(5)]
    seen += [sighting(9, 0.5, 0.4), sighting(10, 1.0, 0.3)]
    assert [one.view.number for one in _best(seen)] == [0, 9, 10, 1]


@pytest.mark.parametrize(
    ("expected_nats", "images"), [(-1.0, [4]), (5.9, [3, 2]), (9.0, [3, 2]), (2.2, [1])]
)
def test_the_places_are_those_of_a_voxel_that_is_as_probable_as_the_find(expected_nats, images):
    likelihood = np.ones(256, np.float32)
    likelihood[[100, 150, 200]] = np.exp([-0.5, 2.0, 4.0])
    # Three voxels: one place with -0.5 nats, two places with 4 and 2, one place with 2.
    values = csr_matrix(
        (np.ones(4, np.float32), ([0, 1, 2, 3], [100, 200, 150, 150])), shape=(4, 256)
    )
    evidence = Evidence(
        label="cup", values=values, place=np.zeros(4, np.uint8), images=np.array([4, 3, 2, 1]),
        first=np.array([0, 1, 3]), of_object=np.zeros(3, np.int64), objects=1,
    )  # fmt: skip
    said = places_of_voxel(evidence, likelihood, expected_nats)
    assert [one.images for one in said] == images, "the strongest first"


def test_of_voxels_that_are_alike_the_one_that_most_images_show_is_explained():
    likelihood = np.ones(256, np.float32)
    likelihood[[150, 160, 200]] = np.exp([2.0, 2.2, 4.0])
    values = csr_matrix((np.ones(3, np.float32), ([0, 1, 2], [150, 160, 200])), shape=(3, 256))
    evidence = Evidence(
        label="cup", values=values, place=np.zeros(3, np.uint8), images=np.array([2, 90, 95]),
        first=np.array([0, 1, 2]), of_object=np.zeros(3, np.int64), objects=1,
    )  # fmt: skip
    (said,) = places_of_voxel(evidence, likelihood, 2.0)
    assert said.images == 90


@pytest.mark.parametrize(
    "size",
    [
        (240, 320), (480, 640), (720, 1280), (481, 641), (480, 848), (504, 896), (480, 752),
        (600, 800), (968, 1296),
    ],
)  # fmt: skip
def test_a_stored_view_is_small_and_reads_the_pixels_of_the_heatmap(size):
    height, width = size
    depth = np.random.default_rng(0).uniform(1.0, 2.0, size).astype(np.float32)
    depth = depth.astype(np.float16).astype(np.float32)
    camera = PinholeCamera.from_horizontal_fov(width, height, 1.2)
    frame = Frame(
        stamp_ns=0, color=np.zeros((*size, 3), np.uint8), depth=depth, camera=camera,
        T_world_camera=np.eye(4), T_world_base=np.eye(4), tilt_rad=0.0,
    )  # fmt: skip
    seen = Detections(source="x", labels=("cup",), ooi=None, image_size=size, instances=())
    one = View.of(0, frame, seen)
    assert one.depth.nbytes <= 2 * 321 * 321
    again = _frame_of(one)
    assert again.camera.horizontal_fov == pytest.approx(camera.horizontal_fov, rel=0.01)
    collectors = [EvidenceCollector(["cup"], 0.05, 5.0) for _ in range(2)]
    for collector, image in zip(collectors, (frame, again), strict=True):
        collector.add(image, heatmap_of_instances(seen, image.depth))
    first, second = (set(np.concatenate(one._keys).tolist()) for one in collectors)
    if width % 320 == 0:
        assert first == second
    assert one.depth_at(width - 1.0, height - 1.0) > 0.0


def test_a_stored_view_keeps_its_masks_in_little_memory():
    height, width = 480, 640
    v, u = np.mgrid[:120, :160]
    masks = [
        (v - 7 * k % 120) ** 2 + (u - 11 * k % 160) ** 2 < (4 + k % 20) ** 2 for k in range(99)
    ]
    instances = [
        Instance(label="cup", score=0.5, box_px=(0.0, 0.0, 9.0, 9.0), mask=mask)
        for mask in (*masks, None)
    ]
    frame = Frame(
        stamp_ns=0, color=np.zeros((height, width, 3), np.uint8),
        depth=np.ones((height, width), np.float32),
        camera=PinholeCamera.from_horizontal_fov(width, height, 1.2),
        T_world_camera=np.eye(4), T_world_base=np.eye(4), tilt_rad=0.0,
    )  # fmt: skip
    one = View.of(
        0, frame,
        Detections(
            source="x", labels=("cup",), ooi=None, image_size=(height, width),
            instances=tuple(instances),
        ),
    )  # fmt: skip
    again = [instance.mask for instance in one.with_masks().instances]
    for mask, expected in zip(again, (*masks, None), strict=True):
        assert (mask is None) if expected is None else (mask == expected).all()
    assert len(pickle.dumps(one)) < 0.2 * sum(mask.nbytes for mask in masks)
