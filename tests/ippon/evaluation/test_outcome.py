import numpy as np
import pytest

from ippon.evaluation.outcome import (
    failure_cause,
    is_at_instance,
    is_wrong_instance,
    shows_object,
    stood_still,
    touched_there,
)
from ippon.mission.snapshot import Find
from ippon.simulation.camera.renderer import Rendering
from ippon.simulation.scene import Instance


@pytest.mark.parametrize(
    ("known", "cause"),
    [
        ({"success": True, "ending": "found"}, "none"),
        ({"ending": "found", "seen": True, "recognised": True}, "false_stop"),
        ({"ending": "found"}, "false_stop"),
        ({"ending": "found", "wrong_instance": True}, "wrong_instance"),
        ({"ending": "exhausted", "wrong_instance": True}, "never_seen"),
        ({"ending": "out_of_reach", "seen": True, "recognised": True}, "out_of_reach"),
        ({"ending": "time", "stuck": True, "seen": True}, "stuck"),
        ({"ending": "time", "stuck": True, "touched": True, "seen": True}, "collision"),
        ({"ending": "time", "touched": True}, "never_seen"),
        ({"ending": "time"}, "never_seen"),
        ({"ending": "exhausted"}, "never_seen"),
        ({"ending": "exhausted", "seen": True}, "seen_and_missed"),
        ({"ending": "exhausted", "seen": True, "recognised": True}, "seen_and_missed"),
        ({"ending": "time", "seen": True}, "seen_and_missed"),
        ({"ending": "time", "seen": True, "recognised": True}, "time"),
    ],
)
def test_the_first_cause_that_applies(known, cause):
    plain = {
        "success": False, "seen": False, "recognised": False, "stuck": False, "touched": False,
    }  # fmt: skip
    assert failure_cause(**{**plain, **known}) == cause


def _rendering(count: int, depth: float) -> Rendering:
    instance = np.full((100, 100), 3, np.int32)
    instance.ravel()[:count] = 7
    return Rendering(
        color=np.zeros((100, 100, 3), np.uint8),
        depth=np.full((100, 100), depth, np.float32),
        instance=instance,
    )


def test_an_object_counts_as_seen_when_it_fills_enough_of_the_image_near_enough():
    assert shows_object(_rendering(5, 2.0), (7,), 4.0)
    assert not shows_object(_rendering(4, 2.0), (7,), 4.0)
    assert not shows_object(_rendering(50, 4.5), (7,), 4.0)
    assert not shows_object(_rendering(50, 0.0), (7,), 4.0)
    assert not shows_object(_rendering(50, 2.0), (), 4.0)
    assert shows_object(_rendering(5, 4.0), (7,), 4.0), "the range belongs to it"
    assert shows_object(_rendering(5, 0.5), (7,), 4.0)


@pytest.mark.parametrize(("pixels", "least"), [(1200, 1), (2000, 1), (2001, 2), (2400, 2)])
def test_the_share_of_an_image_is_rounded_up(pixels, least):
    for count in (least - 1, least):
        instance = np.zeros((1, pixels), np.int32)
        instance[0, :count] = 7
        image = Rendering(
            color=np.zeros((1, pixels, 3), np.uint8),
            depth=np.ones((1, pixels), np.float32),
            instance=instance,
        )
        assert shows_object(image, (7,), 4.0) == (count == least)


def test_a_find_belongs_to_the_instance_that_it_touches():
    box = Instance(node="a", category="bed", label="bed", aabb_min=(0, 0, 0), aabb_max=(2, 1, 0.5))

    def find(x: float) -> Find:
        return Find(
            position_world=(x, 0.5, 0.3), size_m=(0, 0, 0), probability=1, voxels=9, box_px=None
        )

    assert is_at_instance(find(1.0), [box])
    assert is_at_instance(find(2.39), [box])
    assert not is_at_instance(find(2.41), [box])
    assert is_at_instance(find(-0.4), [box]), "0.4 m belongs to it"
    assert not is_at_instance(find(-0.41), [box])
    assert not is_at_instance(find(1.0), [])


def test_a_robot_is_stuck_after_a_minute_in_one_place():
    still = np.zeros((400, 2))
    assert stood_still(still, 0.2)
    assert not stood_still(still[:300], 0.2)
    moving = np.stack([np.linspace(0.0, 4.0, 400), np.zeros(400)], axis=1)
    assert not stood_still(moving, 0.2)
    moving[-301:] = moving[-1]
    assert stood_still(moving, 0.2)


def test_still_is_within_0_3_m_of_the_last_place():
    x = np.zeros((400, 2))
    x[:, 0] = 0.3
    x[-1, 0] = 0.0
    assert stood_still(x, 0.2), "0.3 m belong to it"
    # Half a metre to and fro is within 0.3 m of the middle, where the robot ends.
    x[:, 0] = np.where(np.arange(400) % 2, 0.0, 0.5)
    x[-1, 0] = 0.25
    assert stood_still(x, 0.2)
    x[-1, 0] = 0.0
    assert not stood_still(x, 0.2)
    x[:, 0] = np.where(np.arange(400) < 250, 9.0, 0.0)
    assert not stood_still(x, 0.2), "still for the last 30 s alone"


def test_contact_counts_where_the_robot_stopped_and_just_before():
    # 20 s of driving 10 m along x, 70 s standing.
    positions = np.zeros((450, 2))
    positions[:100, 0], positions[100:, 0] = np.linspace(0.0, 10.0, 100), 10.0

    def touched(*frames: int) -> bool:
        contacts = np.zeros(450, np.bool_)
        contacts[list(frames)] = True
        return touched_there(positions, contacts, 0.2)

    assert not touched()
    assert touched(100)
    assert touched(449)
    # Within 0.3 m from frame 97 on, and 25 frames before that.
    assert touched(72)
    assert not touched(71, 10)
    still = np.zeros((10, 2))
    assert touched_there(still, np.eye(10, dtype=np.bool_)[0], 0.2)


def test_there_is_within_0_3_m_of_the_last_place():
    positions, contacts = np.zeros((40, 2)), np.zeros(40, np.bool_)
    positions[:20, 0] = 9.0
    positions[20:, 0] = 0.3
    positions[-1, 0] = 0.0
    contacts[20] = True
    assert touched_there(positions, contacts, 20.0), "0.3 m belong to it"
    # A last step of 0.4 m leaves the place of the contact.
    positions[-1, 0] = -0.1
    assert not touched_there(positions, contacts, 20.0)
    positions[20:, 0] = 0.05
    positions[-2:, 0] = 0.55, 0.3
    assert touched_there(positions, contacts, 20.0)


def test_the_first_image_counts_too():
    still, contacts = np.zeros((3, 2)), np.array([True, False, False])
    assert touched_there(still, contacts, 20.0)


def test_a_find_is_of_the_wrong_colour_where_no_right_one_is_as_near():
    def mug(x):
        return Instance(
            node="objects.0", category="objects", label="mug", aabb_min=(x, 0.0, 0.0),
            aabb_max=(x + 0.1, 0.1, 0.1),
        )  # fmt: skip

    def is_wrong(x, right=(0.0,), wrong=(1.0,)):
        find = Find(
            position_world=(x, 0.05, 0.05), size_m=(0.1, 0.1, 0.1), probability=0.9, voxels=1,
            box_px=None,
        )  # fmt: skip
        return is_wrong_instance(find, [mug(a) for a in right], [mug(b) for b in wrong])

    assert is_wrong(1.05)
    assert is_wrong(1.3)
    assert not is_wrong(0.05)
    assert not is_wrong(0.4), "it lies nearer to the right one"
    assert not is_wrong(3.0), "it is at no mug at all"
    assert is_wrong(1.05, right=())
    assert not is_wrong(1.05, wrong=())
