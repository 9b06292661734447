"""A robot and a navigator as the network shows them, with a drawn home."""

import threading
import time

import msgspec
import numpy as np
import zenoh

from app.links.language_model.interface import RULES, SentenceAnswer
from app.links.language_model.sentence_reading import as_reading
from app.messages import keys
from app.messages.control import (
    Accepted,
    Bid,
    ControlReply,
    ControlRequest,
    ErrorReply,
    FeedbackRequest,
    QueueRequest,
    SavedSearch,
    SavedSearches,
    SearchAccepted,
    SearchRequest,
    SentenceRequest,
    decode,
    encode,
)
from app.messages.images import decode_color, encode_camera
from app.messages.memory import (
    MemoryNoteRequest,
    MemoryReply,
    MemoryRequest,
    RoomNameRequest,
)
from app.messages.motion import StampedPath, encode_path, encode_transforms, robot_transforms
from app.messages.scene import encode_tree, encode_voxels
from app.messages.status import GoalStatus
from app.nodes.navigator.services.lease_service import LeaseService
from app.nodes.navigator.services.request_services import declare_endpoints
from ippon.camera import PinholeCamera
from ippon.guidance.language.requests.sentence import read_request
from tests.app.nodes.console.drawn_home import (
    camera_image,
    cloud_of,
    cloud_rows,
    home_voxels,
    proximity_of,
    robot_pose,
    rooms_of,
    status_of,
    things_of,
    tree_of,
)


class PublishedHome:
    """A robot and a navigator as the network shows them: real zenoh, real bytes, a drawn home.

    The map grows with every tick, the robot drives, and the plan changes; after `moving_ticks` all
    of that stays as it is, and images and status alone are published: a scene that changes costs a
    third of a core to draw. Requests are answered, and change what the status says.
    """

    def __init__(
        self, port, lease_clock=time.monotonic, robot="ippon", hz=5.0, most_voxels=None,
        moving_ticks=None,
    ):  # fmt: skip
        self.robot, self.hz = robot, hz
        self._moving_ticks = moving_ticks
        self.ticks = 0
        self._lock = threading.RLock()
        self.begin_again()
        self.stamp_ns = 10_000_000_000
        self._indices, self._labels = home_voxels()
        self._order = np.argsort(np.linalg.norm(self._indices[:, :2] - [46, 26], axis=1))
        self._order = self._order[:most_voxels]
        self._shown = 0
        self._stop = threading.Event()
        config = zenoh.Config()
        config.insert_json5("mode", '"router"')
        config.insert_json5("listen/endpoints", f'["tcp/127.0.0.1:{port}"]')
        config.insert_json5("scouting/multicast/enabled", "false")
        self._session = zenoh.open(config)
        self._alive = self._session.liveliness().declare_token(f"{robot}/{keys.NAVIGATOR_ALIVE}")
        self.lease = LeaseService(lease_clock)
        self._endpoints = declare_endpoints(self._session, robot, self.lease)
        for key, answer in {
            keys.SEARCH: self._search,
            keys.BID: self._bid,
            keys.CONTROL: self._control,
            keys.GUIDANCE: self._accept,
            keys.FEEDBACK: self._feedback,
            keys.SENTENCE: self._sentence,
            keys.VOCABULARY: self._accept,
            keys.GOTO: self._accept,
            keys.DRIVE: lambda _: encode(Accepted(detail="manual")),
            keys.PAINT: self._accept,
            keys.QUEUE: self._queue,
            keys.SEARCHES: self._accept,
            keys.SEARCHES_SAVED: lambda _: encode(SavedSearches(searches=self.saved)),
            keys.ROOMS: lambda _: encode(rooms_of(self.room_name)),
            keys.ROOM_NAME: self._name_room,
            keys.MEMORY: self._memory,
            keys.MEMORY_NOTE: self._note,
            keys.MAP_KEYFRAME: lambda _: encode_voxels(self.keyframe()),
            keys.STATUS: lambda _: encode(self.status()),
            keys.LEVELS: lambda _: encode(proximity_of()),
        }.items():
            self._session.declare_queryable(f"{robot}/{key}", self._responder(key, answer))
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def begin_again(self):
        """Search for the hat, with nothing asked yet; the map stays as it is."""
        self.requests = []
        self.state = "searching"
        self.goal = GoalStatus(
            goal_id=1, object="hat", context="I left it on the sofa", outcome="active"
        )
        self.find = None
        self.status_changes = {}
        self.saved = [SavedSearch(saved_id=4, object="my keys", context="in the hall")]
        self.room_name = ""
        self.things = things_of()
        self.frozen = False

    @property
    def frozen(self):
        """Nothing changes, and only the status is published; set, no change is under way."""
        return self._frozen

    @frozen.setter
    def frozen(self, frozen):
        with self._lock:
            self._frozen = frozen

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
            if self._moving_ticks is None or self.ticks <= self._moving_ticks:
                self._move()
        frame = "camera_color_optical_frame"
        camera = PinholeCamera.from_horizontal_fov(400, 250, 1.29)
        self.put(keys.CAMERA_INFO, encode_camera(camera, self.stamp_ns, frame))
        self.put(keys.COLOR, camera_image(self.ticks, stamp_ns=self.stamp_ns))
        self.put(keys.STATUS, encode(self.status()))

    def _move(self):
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
            encode_transforms(robot_transforms(self.stamp_ns, T_world_base, T_base_camera, frame)),
        )
        tree = tree_of(np.random.default_rng(3), 20 + min(self.ticks, 40))
        self.put(keys.PLAN_TREE, encode_tree(tree, self.stamp_ns))
        path = np.stack([T_world_base[:3, 3], [2.3, 4.4, 0.0]])
        self.put(keys.PLAN_PATH, encode_path(StampedPath(stamp_ns=1, points_world=path)))

    def _run(self):
        while not self._stop.wait(1.0 / self.hz):
            with self._lock:
                if self.frozen:
                    self.put(keys.STATUS, encode(self.status()))
                else:
                    self.tick()

    def _responder(self, key, answer):
        def respond(query):
            payload = b"" if query.payload is None else query.payload.to_bytes()
            # Pages ask for the memory and the rooms by themselves, at any time.
            if payload and key not in (keys.MEMORY, keys.ROOMS):
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

    def _bid(self, _):
        bid = Bid(obstacle="searching", detail="hat", ground="room", place="kitchen", way_m=3.2)
        return encode(bid)

    def _control(self, payload):
        action = decode(payload, ControlRequest).action
        self.state = {"stop": "stopped", "resume": "searching", "pause": "paused"}.get(
            action, "searching"
        )
        self.put(keys.STATUS, encode(self.status()))
        return encode(ControlReply(state=self.state))

    def _queue(self, payload):
        if decode(payload, QueueRequest).action == "repeat":
            self.find, self.state = None, "searching"
        return encode(Accepted())

    def _accept(self, _):
        return encode(Accepted())

    def _name_room(self, payload):
        request = decode(payload, RoomNameRequest)
        self.room_name = request.name
        return encode(rooms_of(self.room_name))

    def _memory(self, payload):
        asked = decode(payload, MemoryRequest)
        now_ns = time.time_ns()
        things = [msgspec.structs.replace(one, last_seen_ns=now_ns) for one in self.things]
        picture = b"" if asked.picture is None else decode_color(camera_image()).encoded
        return encode(MemoryReply(things=things, count=len(things), picture=picture))

    def _note(self, payload):
        """As the navigator does: what was denied is not the label any more."""
        request = decode(payload, MemoryNoteRequest)
        at = next(k for k, one in enumerate(self.things) if one.instance_id == request.instance_id)
        one = self.things[at]
        if request.name == "mug":
            return encode(ErrorReply(error="'mug' is a kind of things"))
        if request.name is not None:
            one = msgspec.structs.replace(one, name=request.name)
        if request.deny:
            (label, _), *others = one.alternatives
            one = msgspec.structs.replace(
                one, label=label, probability=0.5, alternatives=others, denied=[request.deny]
            )
        if request.allow:
            others = [(one.label, 0.05)]
            one = msgspec.structs.replace(
                one, label=request.allow, probability=0.9, alternatives=others, denied=[]
            )
        self.things[at] = one
        return encode(one)

    def _sentence(self, payload):
        request = read_request(decode(payload, SentenceRequest).sentence)
        return encode(as_reading(SentenceAnswer(request, RULES, "", "", ""), 1.0))

    def _feedback(self, payload):
        if decode(payload, FeedbackRequest).verdict == "confirm":
            self.goal = msgspec.structs.replace(self.goal, confirmed=True)
            return encode(Accepted())
        self.find = None
        self.state = "searching"
        return encode(Accepted())
