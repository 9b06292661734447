import asyncio
import contextlib
import math
from types import SimpleNamespace

import numpy as np
import pytest

from app.view.drawing.camera_follow import FOV_RAD, START, CameraFollow, framing


class Camera:
    """A browser's camera: it reports back what it was told, and what the hand does."""

    def __init__(self):
        self.aspect = 1.25
        self.position = (3.0, 3.0, 3.0)
        self.look_at = (0.0, 0.0, 0.0)
        self.callbacks = []

    def on_update(self, callback):
        self.callbacks.append(callback)

    def report(self):
        for callback in self.callbacks:
            asyncio.run(callback(self))


@pytest.fixture
def client():
    """A browser that has just connected."""
    return SimpleNamespace(client_id=1, camera=Camera(), atomic=contextlib.nullcontext)


SMALL = (np.array([0.0, 0.0]), np.array([6.0, 5.0]))
LARGE = (np.array([-9.0, 0.0]), np.array([12.0, 14.0]))


@pytest.mark.parametrize("bounds", [SMALL, LARGE, (np.array([0.0, 0]), np.array([20.0, 3.0]))])
@pytest.mark.parametrize("aspect", [0.6, 1.25, 2.2])
def test_all_corners_are_in_the_picture(bounds, aspect):
    low, high = bounds
    view = framing(low, high, aspect)
    eye, target = np.array(view.position), np.array(view.look_at)
    ahead = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(ahead, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    limit = math.tan(0.5 * FOV_RAD)
    for x in (low[0], high[0]):
        for y in (low[1], high[1]):
            ray = np.array([x, y, 0.0]) - eye
            assert abs(ray @ right / (ray @ ahead)) <= limit * aspect
            assert abs(ray @ up / (ray @ ahead)) <= limit


def test_the_map_of_another_floor_is_framed_where_it_is(client):
    follow = CameraFollow()
    follow.add(client)
    follow.step(SMALL, 3.0)
    view = framing(*SMALL, 1.25)
    lift = np.array([0.0, 0.0, 3.0])
    assert client.camera.position == pytest.approx(view.position + lift)
    assert client.camera.look_at == pytest.approx(view.look_at + lift)


def test_a_new_browser_sees_the_whole_map_at_once(client):
    follow = CameraFollow()
    follow.step(SMALL)
    follow.add(client)
    follow.step(None)
    assert client.camera.position == framing(*SMALL, 1.25).position


def test_the_camera_glides_after_a_growing_map(client):
    follow = CameraFollow()
    follow.add(client)
    follow.step(SMALL)
    follow.step(LARGE)
    between = client.camera.position[2]
    assert framing(*SMALL, 1.25).position[2] < between < framing(*LARGE, 1.25).position[2]
    for _ in range(60):
        client.camera.report()
        follow.step(LARGE)
    np.testing.assert_allclose(client.camera.position, framing(*LARGE, 1.25).position, atol=0.05)


def test_the_operators_hand_wins_until_recalled(client):
    follow = CameraFollow()
    follow.add(client)
    follow.step(SMALL)
    client.camera.report()
    client.camera.position = (1.0, 1.0, 9.0)
    client.camera.report()
    follow.step(LARGE)
    assert client.camera.position == (1.0, 1.0, 9.0)
    follow.frame_map(client)
    follow.step(LARGE)
    assert client.camera.position != (1.0, 1.0, 9.0)


def test_what_the_browser_showed_before_is_not_taken_for_a_hand(client):
    before = client.camera.position, client.camera.look_at
    follow = CameraFollow()
    follow.add(client)
    follow.step(SMALL)
    now = client.camera.position, client.camera.look_at
    for pose in (before, ((7.0, 7.0, 7.0), (0.0, 0.0, 0.0)), now):
        client.camera.position, client.camera.look_at = pose
        client.camera.report()
    for _ in range(100):
        follow.step(LARGE)
    np.testing.assert_allclose(client.camera.position, framing(*LARGE, 1.25).position, atol=0.05)


def test_a_camera_that_lags_behind_is_not_taken_for_a_hand(client):
    follow = CameraFollow()
    follow.add(client)
    follow.step(SMALL)
    lagging = []
    for _ in range(100):
        follow.step(LARGE)
        lagging.append((client.camera.position, client.camera.look_at))
    for position, look_at in lagging:
        client.camera.position, client.camera.look_at = position, look_at
        client.camera.report()
    follow.step(SMALL)
    assert client.camera.position[2] < framing(*LARGE, 1.25).position[2]


def test_a_browser_that_dropped_what_it_was_told_is_told_again(client):
    follow = CameraFollow()
    follow.add(client)
    follow.step(SMALL)
    wanted = client.camera.position
    client.camera.position = (3.0, 3.0, 3.0)
    client.camera.report()
    for _ in range(60):
        follow.step(None)
    assert client.camera.position == wanted
    client.camera.report()
    client.camera.position = (4.0, 4.0, 4.0)
    client.camera.report()
    for _ in range(60):
        follow.step(None)
    assert client.camera.position == (4.0, 4.0, 4.0), "once it has arrived, the hand has it"


def test_a_browser_that_goes_back_to_the_start_while_its_scene_comes_up_is_fetched(client):
    follow = CameraFollow()
    follow.add(client)
    follow.step(LARGE)
    client.camera.report()
    client.camera.position, client.camera.look_at = START.position, START.look_at
    client.camera.report()
    for _ in range(60):
        follow.step(None)
    assert client.camera.position == framing(*LARGE, 1.25).position


def test_a_browser_that_dropped_the_last_it_was_told_is_told_again(client):
    follow = CameraFollow()
    follow.add(client)
    follow.step(SMALL)
    client.camera.report()
    before = client.camera.position, client.camera.look_at
    for _ in range(100):
        follow.step(LARGE)
    client.camera.position, client.camera.look_at = before
    client.camera.report()
    for _ in range(60):
        follow.step(None)
    assert client.camera.position == framing(*LARGE, 1.25).position


def test_what_stands_beside_the_map_is_in_the_picture_too(client):
    follow = CameraFollow()
    follow.add(client)
    follow.beside = (np.array([7.5, -1.0]), np.array([13.5, 4.0]))
    for _ in range(100):
        follow.step(SMALL)
    both = framing(np.array([0.0, -1.0]), np.array([13.5, 5.0]), 1.25)
    np.testing.assert_allclose(client.camera.position, both.position, atol=0.05)
    follow.beside = None
    for _ in range(100):
        follow.step(None)
    np.testing.assert_allclose(client.camera.position, framing(*SMALL, 1.25).position, atol=0.05)
