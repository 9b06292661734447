"""A real server, and a client of Foxglove's protocol that subscribes and decodes."""

import json
import time

import numpy as np
import pytest

pytest.importorskip("foxglove", reason="needs the extra foxglove")

from app.messages import keys
from app.messages.cdr import decode
from app.messages.control import encode
from app.messages.depth.depth_images import decode_depth_raw, encode_depth
from app.messages.images import decode_color
from app.messages.memory import MapAlignment
from app.messages.motion import (
    StampedPath,
    StampedTransform,
    decode_path,
    decode_transforms,
    encode_path,
    encode_transforms,
)
from app.messages.scene import decode_tree, decode_voxels
from app.messages.status import Event
from app.nodes.viewers.errors import ViewerError
from app.nodes.viewers.foxglove_server import FoxgloveConfig, FoxgloveServer
from app.nodes.viewers.foxglove_topics import CLOUDS
from app.recording.channels import MARKERS_TYPE
from app.view.colors import ooi_colors
from app.view.model.scene_model import SceneModel
from ippon.geometry import make_transform
from tests.app.nodes.console.drawn_home import status_of
from tests.app.nodes.viewers.foxglove_client import FoxgloveClient
from tests.app.relay import Relay

pytestmark = pytest.mark.process

MAPS = tuple(f"/{key}" for key in CLOUDS)
PROBABILITY = "/map/probability"
STATUS = "/status"


@pytest.fixture
def server():
    """A server on a free port."""
    server = FoxgloveServer(FoxgloveConfig(port=0))
    yield server
    server.close()


@pytest.fixture
def connect(server):
    """Connects clients that know the channels."""
    clients = []

    def connect(*topics):
        client = FoxgloveClient(server.port)
        clients.append(client)
        client.wait(lambda c: STATUS in c.channels)
        client.subscribe(*topics)
        return client

    yield connect
    for client in clients:
        client.close()


def _put_until(client, put, condition):
    """Publish every second until the condition holds: a line that is full loses messages."""
    due = 0.0

    def holds(client):
        nonlocal due
        if condition(client):
            return True
        if time.monotonic() > due:
            due = time.monotonic() + 1.0
            put()
        return False

    client.wait(holds)


def test_every_topic_of_a_running_robot_comes_decodable(server, connect, start_home, show):
    home = start_home()
    with show(server):
        client = connect()
        client.subscribe(*client.channels)
        # Colours change with every tick, and whole maps come once a second.
        client.wait(lambda c: len(c.messages.get(PROBABILITY, ())) > 2)
        depth = np.full((20, 30), 1.25, np.float32)

        def put():
            home.put(keys.EVENT, encode(Event(stamp_ns=5, kind="contact", text="a bump")))
            home.put(keys.DEPTH, encode_depth(depth, 7, "camera"))

        _put_until(client, put, lambda c: {"/camera/depth/image_raw", "/event"} <= set(c.messages))
        client.wait(lambda c: any(b"a bump" in line for line in c.messages.get("/log", ())))
        last = {topic: payloads[-1] for topic, payloads in client.messages.items()}
    assert client.capabilities == ["time"], "clients send no commands"
    assert json.loads(last[STATUS])["goal"]["object"] == "hat"
    assert json.loads(last["/event"])["text"] == "a bump"
    assert decode_color(last["/camera/color/image_raw/compressed"]).encoded
    assert decode_depth_raw(last["/camera/depth/image_raw"]).depth == pytest.approx(depth)
    assert next(link.child for link in decode_transforms(last["/tf"])) == "base_link"
    assert len(decode_tree(last["/plan/tree"])[1].parents) > 20
    assert len(decode_path(last["/plan/path"]).points_world) == 2
    markers = decode(last["/plan/markers"], MARKERS_TYPE).markers
    assert markers[0].ns == "tree"
    channel = client.channels[PROBABILITY]
    assert (channel["schemaName"], channel["encoding"]) == ("sensor_msgs/msg/PointCloud2", "cdr")
    assert "PointField[] fields" in channel["schema"]
    channel = client.channels[STATUS]
    assert (channel["schemaName"], channel["encoding"]) == ("Status", "json")
    assert json.loads(channel["schema"])["properties"]["best_ooi"] == {"type": "number"}
    assert client.times_ns[-1] >= 10_000_000_000, "the robot's clock"
    assert set(client.log_times_ns[-20:]) <= set(client.times_ns)


def test_the_map_is_complete_below_the_ceiling_and_coloured_as_in_the_console(
    server, connect, start_home, show
):
    home = start_home()
    with show(server):
        client = connect(*MAPS)
        client.wait(lambda c: all(len(c.messages.get(name, ())) > 1 for name in MAPS))
        home.frozen = True
        counts = home.keyframe()
        low = np.floor(counts.centers_world[:, 2] / 0.1).astype(int) < 14
        client.wait(
            lambda c: len(decode_voxels(c.messages[PROBABILITY][-1]).ooi) == np.count_nonzero(low)
        )
        cloud = decode_voxels(client.messages[PROBABILITY][-1])
    assert cloud.color.tolist() == ooi_colors(cloud.ooi).tolist()
    assert (cloud.centers_world[:, 2] < 1.4).all()


def test_a_client_that_comes_later_gets_what_was_published_before(
    server, connect, start_home, show, wait
):
    home = start_home()
    with show(server) as robot:
        model = robot.model
        wait(lambda: model.voxels.count > 0 and model.proximity is not None)
        wait(lambda: len(model.path_world) > 0)
        home.frozen = True
        client = connect("/guidance/levels", "/plan/path", PROBABILITY)
        client.wait(lambda c: len(c.messages) == 3)


def test_a_robot_that_comes_late_leaves_and_begins_again(server, connect, start_home, show):
    with show(server):
        client = connect(STATUS, PROBABILITY)
        client.wait(lambda c: "no navigator at tcp/" in c.statuses.get("link", ""))
        home = start_home()
        client.wait(lambda c: PROBABILITY in c.messages and not c.statuses)
        home.close()
        client.wait(lambda c: "what is shown is old" in c.statuses.get("link", ""))
        late = connect(STATUS)
        late.wait(lambda c: "what is shown is old" in c.statuses.get("link", ""))
        client.messages.clear()
        begun = start_home()
        begun.stamp_ns = 1_000_000_000
        client.wait(lambda c: PROBABILITY in c.messages and not c.statuses)
        client.wait(lambda c: len(c.sessions) > 1 and c.times_ns[-1] < 10_000_000_000)


def test_a_line_that_breaks_costs_no_part_of_the_map(server, connect, start_home, show, port):
    home, relay = start_home(), Relay(port)
    with show(server, relay.port) as robot:
        client = connect(PROBABILITY)
        client.wait(lambda c: PROBABILITY in c.messages)
        relay.cut()
        for _ in range(3):
            home.tick()
        home.frozen = True
        low = np.floor(home.keyframe().centers_world[:, 2] / 0.1).astype(int) < 14
        count = np.count_nonzero(low)
        client.wait(lambda c: len(decode_voxels(c.messages[PROBABILITY][-1]).ooi) == count)
        assert robot.model.voxels.count == len(low)
    relay.close()


def test_transforms_of_another_day_are_moved_into_the_frame_of_the_map(
    server, connect, start_home, show
):
    home = start_home()
    with show(server):
        client = connect("/tf")
        client.wait(lambda c: "/tf" in c.messages)
        home.put(keys.MAP_ALIGNMENT, encode(MapAlignment(position_map=(50, 0, 0), yaw_rad=0.0)))
        client.wait(lambda c: _x(c) > 40.0)
        base, camera = decode_transforms(client.messages["/tf"][-1])
    assert (base.parent, camera.parent) == ("map", "base_link")
    assert abs(camera.T_parent_child[0, 3]) < 1.0, "only links from the world move"


def test_fixed_transforms_of_several_messages_come_together_and_outlive_a_restart(
    server, connect, start_home, show
):
    def fixed(parent, child, x):
        link = StampedTransform(
            stamp_ns=5,
            parent=parent,
            child=child,
            T_parent_child=make_transform(np.eye(3), (x, 0, 0)),
        )
        return encode_transforms([link])

    def links(client):
        payloads = client.messages.get("/tf_static", [b""])
        read = decode_transforms(payloads[-1]) if payloads[-1] else ()
        return {link.child: (link.parent, link.T_parent_child[0, 3]) for link in read}

    home = start_home()
    with show(server):
        client = connect("/tf_static", STATUS)
        client.wait(lambda c: STATUS in c.messages)
        home.put(keys.TF_STATIC, fixed("base_link", "mast", 1.0))
        home.put(keys.TF_STATIC, fixed("mast", "lidar", 2.0))
        home.put(keys.TF_STATIC, fixed("base_link", "mast", 3.0))
        home.put(keys.TF_STATIC, fixed("map", "dock", 4.0))
        both = {"mast": ("base_link", 3.0), "lidar": ("mast", 2.0), "dock": ("map", 4.0)}
        client.wait(lambda c: links(c) == both)
        late = connect("/tf_static")
        late.wait(lambda c: links(c) == both)
        late.messages.clear()

        def has_begun_again(client):
            if len(client.sessions) < 2:
                # The home's own thread, which counts on, may overwrite it.
                home.stamp_ns = 1_000_000_000
            return len(client.sessions) > 1 and links(client) == both

        late.wait(has_begun_again)
        later = connect("/tf_static")
        later.wait(lambda c: links(c) == both)
        home.put(keys.MAP_ALIGNMENT, encode(MapAlignment(position_map=(50, 0, 0), yaw_rad=0.0)))
        later.wait(lambda c: links(c) == both | {"dock": ("map", 54.0)})


def test_what_a_new_navigator_publishes_before_its_first_status_is_kept(server, connect):
    levels, model = b'{"labels": ["of the new navigator"]}', SceneModel()
    for payload, stamp_ns in ((b"{}", 10_000_000_000), (levels, 1_000_000_000)):
        server.take(keys.LEVELS, payload)
        server.take(
            keys.PLAN_PATH, encode_path(StampedPath(stamp_ns=1, points_world=np.zeros((1, 3))))
        )
        model.on_status(status_of(stamp_ns=stamp_ns))
        server.draw(model, model.take_changes())
    assert server._kept[keys.LEVELS] == levels
    assert keys.PLAN_PATH not in server._kept, "the new navigator may have none"
    client = connect("/guidance/levels")

    def has_come(client):
        server.draw(model, frozenset())
        return "/guidance/levels" in client.messages

    client.wait(has_come)
    assert client.messages["/guidance/levels"] == [levels]


def test_the_clock_goes_on_while_a_navigator_that_was_started_again_has_no_time(server):
    path, model, times = StampedPath(stamp_ns=1, points_world=np.zeros((1, 3))), SceneModel(), []
    for stamp_ns in (10_000_000_000, 0, 11_000_000_000):
        server.take(keys.PLAN_PATH, encode_path(path))
        model.on_status(status_of(stamp_ns=stamp_ns))
        server.draw(model, model.take_changes())
        times.append((server._now_ns, keys.PLAN_PATH in server._kept))
    assert times == [(10_000_000_000, True), (10_000_000_000, False), (11_000_000_000, True)]


def _x(client):
    return decode_transforms(client.messages["/tf"][-1])[0].T_parent_child[0, 3]


def test_damaged_messages_are_skipped(server, connect, start_home, show):
    home = start_home()
    with show(server):
        client = connect(STATUS, "/camera/depth/image_raw")
        client.wait(lambda c: STATUS in c.messages)
        for key in (keys.STATUS, keys.EVENT, keys.DEPTH, keys.TF, keys.MAP_VOXELS):
            home.put(key, b"damaged")
        seen = len(client.messages[STATUS])
        client.wait(lambda c: len(c.messages[STATUS]) > seen + 3)
    assert b"damaged" not in client.messages[STATUS]


def test_a_port_that_is_taken_is_said(server):
    with pytest.raises(ViewerError, match=rf"cannot serve on 127.0.0.1:{server.port}: .*--port"):
        FoxgloveServer(FoxgloveConfig(port=server.port))
