"""The camera's WebSocket on a real socket."""

import json
import struct
import time

import numpy as np
import pytest

from app.messages.images import encode_color
from tests.app.nodes.console.served import closing_code

NOISE = np.random.default_rng(1).integers(0, 255, (480, 640, 3)).astype(np.uint8)


def _picture(socket):
    while True:
        message = socket.recv(timeout=10)
        if isinstance(message, bytes):
            (length,) = struct.unpack_from("<I", message)
            return json.loads(message[4 : 4 + length]), len(message)


def _open(client, **wish):
    socket = client.socket("/api/camera")
    socket.send(json.dumps({"type": "show", "longest_px": 640, "label": None} | wish))
    return socket


@pytest.mark.slow
def test_a_page_gets_pictures_and_the_latency_of_those_that_it_has_drawn(client, state_feed):
    state_feed.camera.take_image(encode_color(NOISE, 7, "camera"))
    with _open(client) as socket:
        header, _ = _picture(socket)
        assert header["stamp_ns"] == "7"
        socket.send(json.dumps({"type": "drawn", "number": header["number"]}))
        latency = json.loads(socket.recv(timeout=10))
        assert latency["type"] == "latency"
        assert 0 <= latency["ms"] < 5_000


def test_a_page_that_draws_nothing_gets_two_pictures_and_then_the_newest(client, state_feed):
    with _open(client) as socket:
        pictures = []
        for stamp in (1, 2):
            state_feed.camera.take_image(encode_color(NOISE, stamp, "camera"))
            pictures.append(_picture(socket)[0])
        first, second = pictures
        for stamp in range(3, 12):
            state_feed.camera.take_image(encode_color(NOISE, stamp, "camera"))
            time.sleep(0.05)
        socket.send(json.dumps({"type": "drawn", "number": first["number"]}))
        third = _picture(socket)[0]
        assert second["number"] < third["number"]
        assert third["stamp_ns"] == "11", "no old picture is sent after a pause"


@pytest.mark.slow
def test_the_worst_picture_at_ten_hertz_stays_below_two_megabits(client, state_feed):
    """Noise is what JPEG compresses least."""
    noise = encode_color(NOISE, 0, "camera", quality=95)
    sizes, started = [], time.monotonic()
    with _open(client) as socket:
        while (took_s := time.monotonic() - started) < 4.0 or (len(sizes) < 6 and took_s < 60.0):
            state_feed.camera.take_image(noise)
            try:
                message = socket.recv(timeout=0.1)
            except TimeoutError:
                continue
            if isinstance(message, bytes):
                (length,) = struct.unpack_from("<I", message)
                number = json.loads(message[4 : 4 + length])["number"]
                socket.send(json.dumps({"type": "drawn", "number": number}))
                sizes.append(len(message))
    assert len(sizes) > 5
    assert 8 * sum(sizes) / took_s < 2e6


def test_a_hidden_camera_costs_nothing(client, state_feed):
    with _open(client, longest_px=0) as socket:
        state_feed.camera.take_image(encode_color(NOISE, 1, "camera"))
        try:
            socket.recv(timeout=0.5)
        except TimeoutError:
            pass
        else:
            raise AssertionError("nobody asked for a picture")


def test_a_damaged_image_is_skipped(client, state_feed):
    with _open(client) as socket:
        cut = encode_color(NOISE, 1, "camera").replace(b"\xff\xda", b"\xff\x00")
        state_feed.camera.take_image(cut)
        time.sleep(0.2)
        state_feed.camera.take_image(encode_color(NOISE, 2, "camera"))
        assert _picture(socket)[0]["stamp_ns"] == "2"


def test_what_is_no_message_of_a_camera_view_ends_it(client):
    for text in ("{", '{"type":"show"}', '{"type":"show","longest_px":-1}', "x" * 5_000):
        with client.socket("/api/camera") as socket:
            socket.send(text)
            assert closing_code(socket) == 1007
