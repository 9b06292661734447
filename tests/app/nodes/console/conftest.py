"""A small furnished home as the navigator would publish it, for the tests of the console."""

import dataclasses
import itertools
import math
import socket
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import httpx
import msgspec
import numpy as np
import pytest
import uvicorn
import viser
import websockets.sync.client
import zenoh
import zstandard

from app.messages import keys
from app.messages.control import (
    Accepted,
    ControlReply,
    ControlRequest,
    ErrorReply,
    FindReport,
    GoalStatus,
    ProximityRow,
    ProximityTable,
    SearchAccepted,
    SearchRequest,
    SentenceReading,
    SentenceRequest,
    Status,
    StreamStatus,
    Timings,
    decode,
    encode,
)
from app.messages.images import encode_camera, encode_color
from app.messages.motion import StampedPath, StampedTransform, encode_path, encode_transforms
from app.messages.scene import VoxelCloud, encode_tree, encode_voxels
from app.nodes.console.node import server_settings
from app.nodes.navigator.lease_desk import LeaseDesk
from ippon.camera import PinholeCamera
from ippon.geometry import base_pose
from ippon.guidance.levels import Level
from ippon.guidance.sentence import read_query
from ippon.planning.plan import NodeKind, TreeView
from ippon.robot import ZED

ROOT = Path(__file__).parents[4]
VOXEL_M = 0.1
LABELS = ("wall", "floor", "sofa", "table", "bed", "plant")
LEVELS = {
    "wall": "far",
    "floor": "far",
    "sofa": "certain",
    "table": "near",
    "bed": "average",
    "plant": "average",
}
COLORS = {
    "wall": (214, 208, 196),
    "floor": (164, 124, 84),
    "sofa": (74, 104, 150),
    "table": (120, 82, 52),
    "bed": (196, 190, 205),
    "plant": (66, 120, 62),
}


def _box(lo, hi):
    """Surface voxels of a box given in voxels."""
    grid = np.stack(
        np.meshgrid(*[np.arange(a, b) for a, b in zip(lo, hi, strict=True)], indexing="ij"), -1
    ).reshape(-1, 3)
    edge = (grid == np.array(lo)) | (grid == np.array(hi) - 1)
    return grid[edge.any(axis=1)]


def home_voxels():
    """Return (N, 3) indices and (N,) labels of an 8 m by 6 m flat with a dividing wall."""
    parts = [
        ("floor", np.array(list(itertools.product(range(80), range(60), [-1])))),
        ("wall", _box((0, -1, 0), (80, 0, 26))),
        ("wall", _box((0, 60, 0), (80, 61, 26))),
        ("wall", _box((-1, 0, 0), (0, 60, 26))),
        ("wall", _box((80, 0, 0), (81, 60, 26))),
        ("wall", _box((40, 0, 0), (41, 22, 26))),
        ("wall", _box((40, 34, 0), (41, 60, 26))),
        ("sofa", _box((8, 50, 0), (30, 58, 4))),
        ("sofa", _box((8, 56, 4), (30, 58, 8))),
        ("table", _box((14, 36, 3), (26, 44, 5))),
        ("bed", _box((56, 40, 0), (76, 58, 5))),
        ("plant", _box((72, 4, 0), (76, 8, 12))),
        ("table", _box((50, 2, 0), (60, 10, 8))),
    ]
    indices = np.concatenate([voxels for _, voxels in parts])
    labels = np.concatenate(
        [np.full(len(voxels), LABELS.index(name), np.uint8) for name, voxels in parts]
    )
    return indices, labels


def cloud_of(indices, labels, stamp_ns, *, hat=False):
    """Pack voxels as the navigator does."""
    n = len(indices)
    names = np.array(LABELS)[labels]
    rng = np.random.default_rng(1)
    color = np.array([COLORS[name] for name in LABELS], np.int16)[labels]
    color = np.clip(color + rng.integers(-8, 9, (n, 1)), 0, 255).astype(np.uint8)
    level = np.array([Level.parse(LEVELS[name]) for name in LABELS], np.uint8)[labels]
    centers = ((indices + 0.5) * VOXEL_M).astype(np.float32)
    distance = np.linalg.norm(centers - np.array([2.4, 5.2, 0.6]), axis=1)
    ooi = np.where(names == "sofa", 60, 4).astype(np.uint8)
    if hat:
        ooi = np.maximum(ooi, (254 * np.exp(-((distance / 0.35) ** 2))).astype(np.uint8))
    return VoxelCloud(
        stamp_ns=stamp_ns,
        centers_world=centers,
        color=color,
        ooi=ooi,
        proximity=(level * 60).astype(np.uint8),
        level=level,
        label=labels,
        confidence=np.full(n, 200, np.uint8),
        removed=np.zeros(n, bool),
    )


def tree_of(rng, count=60):
    """Grow a random tree over the flat."""
    positions = [(2.0, 2.0, 0.0)]
    parents = [-1]
    while len(positions) < count:
        p = np.array([rng.uniform(0.5, 7.5), rng.uniform(0.5, 5.5), 0.0])
        distance = [math.dist(p, q) for q in positions]
        near = int(np.argmin(distance))
        if 0.3 < distance[near] < 1.2:
            positions.append(tuple(p.tolist()))
            parents.append(near)
    n = len(positions)
    points = np.array(positions, np.float32)
    gains = (40 * np.exp(-np.linalg.norm(points[:, :2] - [2.4, 5.2], axis=1))).astype(np.float32)
    kinds = np.full(n, NodeKind.EXPLORING, np.uint8)
    kinds[gains < 0.6] = NodeKind.MINIMAL
    kinds[np.argsort(gains)[-3:]] = NodeKind.TERMINATING
    return TreeView(
        positions_world=points,
        parents=np.array(parents, np.int32),
        yaws_rad=rng.uniform(-3, 3, n).astype(np.float32),
        tilts_rad=np.zeros(n, np.float32),
        gains=gains,
        terminations=np.zeros(n, np.float32),
        path_costs_s=np.linspace(0, 20, n).astype(np.float32),
        levels=np.zeros(n, np.uint8),
        kinds=kinds,
    )


def status_of(state="searching", **changes):
    """A plausible status."""
    goal = GoalStatus(goal_id=1, object="hat", context="I left it on the sofa", outcome="active")
    status = {
        "robot": "ippon",
        "version": "0.1.0",
        "stamp_ns": 10_000_000_000,
        "wall_ns": time.time_ns(),
        "state": state,
        "why": "going to the viewpoint by the sofa (certain): gain 41, 6.2 s away",
        "goal": goal,
        "queue": [],
        "history": [],
        "find": None,
        "streams": [StreamStatus(name="camera/color", age_s=0.1, rate_hz=5.0)],
        "timings": Timings(step_ms=92.0, map_ms=38.0, plan_ms=41.0, frame_age_ms=128.0),
        "frames": 50,
        "elapsed_s": 12.4,
        "path_length_m": 4.2,
        "best_ooi": 0.41,
        "explored_m2": 31.0,
        "surface_voxels": 12_000,
        "voxel_size_m": VOXEL_M,
        "map_revision": 50,
    }
    return Status(**(status | changes))


def find_of():
    """The hat on the sofa."""
    return FindReport(
        goal_id=1,
        object="hat",
        position_world=(2.4, 5.2, 0.6),
        size_m=(0.3, 0.3, 0.2),
        probability=0.93,
        voxels=24,
        box_px=(150, 90, 240, 160),
    )


def proximity_of():
    """The levels of the six labels."""
    rows = [
        ProximityRow(label=label, level=level, reason=f"a hat and a {label}")
        for label, level in LEVELS.items()
    ]
    return ProximityTable(
        goal_id=1,
        object="hat",
        context="I left it on the sofa",
        provider="embedded common sense",
        elapsed_ms=3.0,
        rows=rows,
        prompt="I am a robot, and I am to find an object: hat.\n\nRate every category.",
        reply="sofa: <b>hats</b> are left there. CERTAIN",
    )


def camera_image(tick=0, size=(400, 250), stamp_ns=0):
    """A drawn camera picture: a sofa with a hat, encoded as JPEG in a CompressedImage."""
    width, height = size
    image = np.zeros((height, width, 3), np.uint8)
    image[:130] = (206, 200, 188)
    image[130:] = (150, 114, 78)
    image[100:190, 90:330] = (74, 104, 150)
    image[95:150, 160:230] = (120, 30, 40)
    image[:, (tick * 7) % width] = 255
    return encode_color(image, stamp_ns, "camera_color_optical_frame")


def robot_pose(tick):
    """Drive from the door towards the sofa."""
    s = min(tick * 0.02, 1.0)
    x, y = 4.6 - 1.5 * s, 2.6 + 2.0 * s
    T_world_base = base_pose(x, y, 0.0, math.radians(120.0))
    return T_world_base, ZED.T_base_camera(-0.35)


def cloud_rows(cloud, rows):
    """Return some rows of a cloud."""
    arrays = {
        field.name: getattr(cloud, field.name)[rows]
        for field in dataclasses.fields(cloud)
        if field.name != "stamp_ns"
    }
    return dataclasses.replace(cloud, **arrays)


class PublishedHome:
    """A robot and a navigator as the network shows them: real zenoh, real bytes, a drawn home.

    The map grows with every tick. Requests are answered, and change what the status says.
    """

    def __init__(self, port, lease_clock=time.monotonic, robot="ippon", hz=5.0):
        self.robot, self.hz = robot, hz
        self.requests = []
        self.state = "searching"
        self.goal = GoalStatus(
            goal_id=1, object="hat", context="I left it on the sofa", outcome="active"
        )
        self.find = None
        self.ticks = 0
        self.status_changes = {}
        self.frozen = False
        """Nothing changes, and only the status is published."""
        self.stamp_ns = 10_000_000_000
        self._indices, self._labels = home_voxels()
        self._order = np.argsort(np.linalg.norm(self._indices[:, :2] - [46, 26], axis=1))
        self._shown = 0
        self._lock = threading.RLock()
        self._stop = threading.Event()
        config = zenoh.Config()
        config.insert_json5("mode", '"router"')
        config.insert_json5("listen/endpoints", f'["tcp/127.0.0.1:{port}"]')
        config.insert_json5("scouting/multicast/enabled", "false")
        self._session = zenoh.open(config)
        self.lease = LeaseDesk(self._session, robot, lease_clock)
        for key, answer in {
            keys.SEARCH: self._search,
            keys.CONTROL: self._control,
            keys.GUIDANCE: self._accept,
            keys.FEEDBACK: self._feedback,
            keys.SENTENCE: self._sentence,
            keys.VOCABULARY: self._accept,
            keys.GOTO: self._accept,
            keys.PAINT: self._accept,
            keys.MAP_KEYFRAME: lambda _: encode_voxels(self.keyframe()),
            keys.STATUS: lambda _: encode(self.status()),
            keys.PROXIMITY: lambda _: encode(proximity_of()),
        }.items():
            self._session.declare_queryable(f"{robot}/{key}", self._responder(key, answer))
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self):
        self._stop.set()
        self._thread.join(5)
        self._session.close()

    def put(self, key, payload):
        self._session.put(f"{self.robot}/{key}", payload)

    def status(self):
        return status_of(
            self.state,
            goal=self.goal,
            find=self.find,
            stamp_ns=self.stamp_ns,
            frames=self.ticks,
            elapsed_s=self.ticks / self.hz,
            surface_voxels=self._shown,
            explored_m2=self._shown * 0.004,
            best_ooi=min(0.95, self.ticks / 100),
            map_revision=self.ticks,
            lease=self.lease.status(),
            **self.status_changes,
        )

    def keyframe(self):
        with self._lock:
            rows = self._order[: self._shown]
            cloud = cloud_of(self._indices, self._labels, self.stamp_ns, hat=self.ticks > 20)
            return cloud_rows(cloud, rows)

    def tick(self):
        with self._lock:
            self.ticks += 1
            self.stamp_ns += int(1e9 / self.hz)
            cloud = cloud_of(self._indices, self._labels, self.stamp_ns, hat=self.ticks > 20)
            more = min(self._shown + 600, len(self._order))
            rows = self._order[self._shown : more]
            if self.ticks % 10 == 0:
                rows = self._order[:more]
            self._shown = more
            self.put(keys.MAP_VOXELS, encode_voxels(cloud_rows(cloud, rows)))
        T_world_base, T_base_camera = robot_pose(self.ticks)
        frame = "camera_color_optical_frame"
        self.put(
            keys.TF,
            encode_transforms(
                StampedTransform(stamp_ns=self.stamp_ns, parent=a, child=b, T_parent_child=T)
                for a, b, T in [
                    ("map", "base_link", T_world_base),
                    ("base_link", frame, T_base_camera),
                ]
            ),
        )
        camera = PinholeCamera.from_horizontal_fov(400, 250, 1.29)
        self.put(keys.CAMERA_INFO, encode_camera(camera, self.stamp_ns, frame))
        self.put(keys.COLOR, camera_image(self.ticks, stamp_ns=self.stamp_ns))
        tree = tree_of(np.random.default_rng(3), 20 + min(self.ticks, 40))
        self.put(keys.PLAN_TREE, encode_tree(tree, self.stamp_ns))
        path = np.stack([T_world_base[:3, 3], [2.3, 4.4, 0.0]])
        self.put(keys.PLAN_PATH, encode_path(StampedPath(stamp_ns=1, points_world=path)))
        self.put(keys.STATUS, encode(self.status()))

    def _run(self):
        while not self._stop.wait(1.0 / self.hz):
            if self.frozen:
                self.put(keys.STATUS, encode(self.status()))
            else:
                self.tick()

    def _responder(self, key, answer):
        def respond(query):
            payload = b"" if query.payload is None else query.payload.to_bytes()
            if payload:
                self.requests.append((key, payload))
            query.reply(f"{self.robot}/{key}", answer(payload))

        return respond

    def _search(self, payload):
        try:
            request = decode(payload, SearchRequest)
        except msgspec.DecodeError as error:
            return encode(ErrorReply(error=str(error)))
        if request.object == "unicorn":
            return encode(ErrorReply(error="nobody has ever seen a unicorn"))
        self.goal = GoalStatus(
            goal_id=2, object=request.object, context=request.context, outcome="active"
        )
        self.find = None
        self.state = "searching"
        return encode(SearchAccepted(goal_id=2, object=request.object, position=0))

    def _control(self, payload):
        action = decode(payload, ControlRequest).action
        self.state = {"stop": "stopped", "resume": "searching", "pause": "paused"}.get(
            action, "searching"
        )
        self.put(keys.STATUS, encode(self.status()))
        return encode(ControlReply(state=self.state))

    def _accept(self, _):
        return encode(Accepted())

    def _sentence(self, payload):
        query = read_query(decode(payload, SentenceRequest).sentence)
        return encode(
            SentenceReading(
                object=query.object,
                context=query.context,
                doubtful=query.doubtful,
                provider="rules",
                elapsed_ms=1.0,
            )
        )

    def _feedback(self, payload):
        self.find = None
        self.state = "searching"
        return encode(Accepted())


class Served:
    """The gateway on a real socket, and a browser's requests to it."""

    def __init__(self, gateway):
        self._server = uvicorn.Server(server_settings(gateway.app(), port=0))
        self._thread = threading.Thread(target=self._server.run, daemon=True)
        self._thread.start()
        deadline = time.monotonic() + 20.0
        while not self._server.started:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        self.port = self._server.servers[0].sockets[0].getsockname()[1]
        self.host = f"127.0.0.1:{self.port}"
        self.origin = f"http://{self.host}"
        self.http = httpx.Client(base_url=self.origin, headers={"Origin": self.origin})
        self.get, self.post = self.http.get, self.http.post

    def socket(self, path, *, origin=None, subprotocols=None, cookie=None):
        return websockets.sync.client.connect(
            f"ws://{self.host}{path}",
            origin=origin or self.origin,
            subprotocols=subprotocols,
            additional_headers={"Cookie": cookie} if cookie else None,
            max_size=None,
        )

    def close(self):
        self.http.close()
        self._server.should_exit = True
        self._thread.join(10)


def free_port():
    """Return a loopback port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


START = """
import logging, sys
from pathlib import Path
from app.nodes.console.node import ConsoleConfig, run_console
logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s %(message)s")
more = {"users": Path(sys.argv[3])} if len(sys.argv) > 3 else {}
run_console(ConsoleConfig(connect=sys.argv[1], port=int(sys.argv[2]), **more))
"""


class ConsoleProcess:
    """The console as its own process."""

    def __init__(self, zenoh_port, port, users=None):
        self.url = f"http://127.0.0.1:{port}"
        self.started_at = time.monotonic()
        self.process = subprocess.Popen(
            [
                sys.executable,
                "-c",
                START,
                f"tcp/127.0.0.1:{zenoh_port}",
                str(port),
                *([] if users is None else [str(users)]),
            ],
            cwd=ROOT,
        )

    def wait_until_up(self, timeout_s=30.0):
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            assert self.process.poll() is None, "the console has ended"
            try:
                answer = httpx.get(f"{self.url}/health", timeout=1.0)
                return answer.json() if answer.is_success else None
            except httpx.TransportError:
                time.sleep(0.05)
        raise TimeoutError("the console does not answer")

    def kill(self):
        self.process.kill()
        self.process.wait(10)

    def close(self):
        self.process.terminate()
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.kill()


class SceneWatcher:
    """A browser's scene without the browser: reads what viser sends, as viser's client does."""

    def __init__(self, url):
        self.points = {}
        """Points of every cloud of the map, by name."""
        self.bytes = 0
        self._socket = websockets.sync.client.connect(
            url.replace("http:", "ws:") + "/view",
            origin=url,
            subprotocols=[f"viser-v{viser.__version__}"],
            max_size=None,
            ping_interval=None,
        )

    def close(self):
        self._socket.close()

    def read(self, quiet_s=0.5, timeout_s=10.0):
        """Read until nothing has come for a while."""
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            try:
                self._take(self._socket.recv(timeout=quiet_s))
            except TimeoutError:
                return

    def read_until(self, condition, timeout_s=20.0):
        deadline = time.monotonic() + timeout_s
        while not condition(self):
            self._take(self._socket.recv(timeout=max(deadline - time.monotonic(), 0.01)))

    def _take(self, data):
        self.bytes += len(data)
        size, packed = struct.unpack_from("<QQ", data)
        text = zstandard.ZstdDecompressor().decompress(data[16 : 16 + packed], size)
        content = msgspec.msgpack.decode(text)
        lengths = content.get("binaryBufferLengths") or ()
        for message in content["messages"]:
            name = message.get("name", "")
            if name.startswith("/map/"):
                changed = message.get("props") or message.get("updates") or {}
                if isinstance(changed.get("points"), dict):
                    self.points[name] = lengths[changed["points"]["__binary_index"]] // 6


@pytest.fixture
def stage():
    """The drawn home, as functions."""
    return SimpleNamespace(
        home_voxels=home_voxels,
        cloud_of=cloud_of,
        tree_of=tree_of,
        status_of=status_of,
        find_of=find_of,
        proximity_of=proximity_of,
        camera_image=camera_image,
        PublishedHome=PublishedHome,
        ConsoleProcess=ConsoleProcess,
        Served=Served,
        free_port=free_port,
        SceneWatcher=SceneWatcher,
    )
