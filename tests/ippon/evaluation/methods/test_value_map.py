import math

import numpy as np
import pytest

from ippon.camera import PinholeCamera
from ippon.evaluation.methods.value_map import ValueMap
from ippon.frame import Frame
from ippon.geometry import base_pose
from ippon.observation import Heatmap
from ippon.robot import ZED

_LABELS = ("wall", "sofa")
_LEVELS = {"wall": 0.1, "sofa": 0.6}


def _frame(shares, *, yaw=0.0, depth=4.0, ooi="hat", tilt=0.0):
    camera = PinholeCamera.from_horizontal_fov(40, 30, math.radians(74.0))
    pixels = np.round(255.0 * np.array(shares)).astype(np.uint8)
    base = base_pose(0.0, 0.0, 0.0, yaw)
    return Frame(
        stamp_ns=0,
        color=np.zeros((30, 40, 3), np.uint8),
        depth=np.full((30, 40), depth, np.float32),
        camera=camera,
        T_world_camera=base @ ZED.T_base_camera(tilt),
        T_world_base=base,
        tilt_rad=tilt,
        heatmap=Heatmap(
            labels=_LABELS, ooi=ooi, probabilities=np.broadcast_to(pixels, (6, 8, len(pixels)))
        ),
    )


def test_the_value_of_an_image_is_the_mean_of_its_labels():
    values = ValueMap(_LEVELS)
    assert values.image_value(_frame([1.0, 0.0, 0.0])) == pytest.approx(0.1)
    assert values.image_value(_frame([0.0, 1.0, 0.0])) == pytest.approx(0.6)
    assert values.image_value(_frame([0.0, 0.0, 1.0])) == pytest.approx(1.0)
    assert values.image_value(_frame([0.6, 0.4, 0.0])) == pytest.approx(0.3)


def test_a_common_object_is_its_own_evidence():
    assert ValueMap(_LEVELS).image_value(_frame([0.0, 1.0], ooi="sofa")) == pytest.approx(1.0)


def test_labels_that_an_image_lacks_change_nothing():
    more = {"door": 0.9, **_LEVELS}
    frame = _frame([0.6, 0.4, 0.0])
    assert ValueMap(more).image_value(frame) == ValueMap(_LEVELS).image_value(frame)
    assert ValueMap({"wall": 0.1}).image_value(frame) == pytest.approx(0.06)


def test_only_the_floor_ahead_gets_the_value():
    values = ValueMap(_LEVELS)
    values.observe(_frame([0.0, 1.0, 0.0]))
    assert values.value_near(2.0, 0.0) == pytest.approx(0.6, abs=1e-5)
    assert values.value_near(-2.0, 0.0) == 0.0
    assert values.value_near(0.0, 2.0, 0.3) == 0.0
    assert values.value_near(4.7, 0.0, 0.3) == 0.0


def test_cells_behind_walls_are_not_updated():
    values = ValueMap(_LEVELS)
    values.observe(_frame([0.0, 1.0, 0.0], depth=1.5))
    assert values.value_near(1.0, 0.0, 0.2) > 0.5
    assert values.value_near(2.5, 0.0, 0.3) == 0.0


def test_without_a_return_the_camera_saw_to_its_range():
    values = ValueMap(_LEVELS)
    values.observe(_frame([0.0, 1.0, 0.0], depth=0.0))
    assert values.value_near(4.5, 0.0, 0.2) > 0.5


def test_two_looks_are_weighed_by_their_confidence():
    # Straight ahead the first look has confidence 1, the second, turned by half of half the field
    # of view, cos²(45°) = 1/2: (1 * 0.6 + 1/2 * 0.1) / (3/2).
    values = ValueMap(_LEVELS)
    values.observe(_frame([0.0, 1.0, 0.0]))
    values.observe(_frame([1.0, 0.0, 0.0], yaw=0.5 * math.radians(37.0)))
    assert values.value_near(3.0, 0.0, 0.01) == pytest.approx(0.65 / 1.5, abs=0.02)


def test_an_image_straight_down_updates_nothing():
    values = ValueMap(_LEVELS)
    values.observe(_frame([0.0, 1.0, 0.0], tilt=-1.5))
    assert values.value_near(1.0, 0.0) == 0.0


def test_nothing_is_known_before_the_first_image():
    assert ValueMap(_LEVELS).value_near(0.0, 0.0) == 0.0
