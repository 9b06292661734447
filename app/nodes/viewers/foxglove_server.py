"""Serves a running robot to Foxglove, over its WebSocket protocol."""

import logging
import time
from collections import deque
from dataclasses import dataclass
from typing import Final

import foxglove
from foxglove.channels import LogChannel
from foxglove.messages import Log, LogLevel, Timestamp
from foxglove.websocket import Capability, ChannelView, Client, ServerListener, StatusLevel

from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.control import decode
from app.messages.keys import BASE_FRAME
from app.messages.memory import MapAlignment
from app.messages.motion import (
    MAX_TRANSFORMS,
    StampedTransform,
    decode_transforms,
    encode_transforms,
)
from app.messages.scene import FoundObject
from app.messages.status import Event, FindReport
from app.nodes.viewers.errors import ViewerError
from app.nodes.viewers.foxglove_schema import schema_of
from app.nodes.viewers.foxglove_topics import (
    BODY_KEY,
    CLOUDS,
    FORWARDED,
    JSON_TYPES,
    KEPT,
    LOG_KEY,
    ROS_TYPES,
    aligned_transforms,
    depth_image,
    whole_maps,
)
from app.nodes.viewers.live_robot import CEILING_M, LinkState, LiveRobot, begins_again, clock_ns
from app.process.stop_signal import ProcessStopSignal
from app.recording.channels import MARKERS_KEY, ros_name, ros_schema
from app.recording.writing.markers import encode_body, encode_markers
from app.view.model.scene_model import Part, SceneModel
from ippon.geometry import Float64Array

logger = logging.getLogger(__name__)

MAP_S: Final = 1.0
"""Interval between two whole maps."""
MARKERS_S: Final = 1.0
LOOPBACK: Final = ("127.0.0.1", "localhost", "::1")
_LINK: Final = "link"
_OF_SESSION: Final = (
    keys.PLAN_PATH, keys.PLAN_TREE, keys.DETECTIONS, keys.FAR_EVIDENCE, BODY_KEY,
)  # fmt: skip
"""Kept topics that a new navigator publishes only after a while, or that carry a time."""
_WARNINGS: Final = frozenset({"contact", "stream_lost", "bad_message", "map_full"})


@dataclass(frozen=True, slots=True, kw_only=True)
class FoxgloveConfig:
    """Address of the server, and the robot."""

    connect: str = "tcp/127.0.0.1:7447"
    robot: str = "ippon"
    host: str = "127.0.0.1"
    port: int = 8765
    """0 selects any free port."""
    ceiling_m: float = CEILING_M
    """Height above which no voxel is served."""

    def __post_init__(self) -> None:
        """Refuse a port that is none."""
        if not 0 <= self.port <= 65535:
            raise ValueError(f"a port lies in 0 to 65535; got {self.port}")


class FoxgloveServer(ServerListener):
    """A viewer that any number of Foxglove clients connect to; it takes no commands."""

    def __init__(self, config: FoxgloveConfig) -> None:
        """Listen.

        Raises:
            ViewerError: The address cannot be listened on.
        """
        context = self._context = foxglove.Context()
        # Without the robot's prefix, so that one layout fits every robot.
        names = {key: ros_name(key) for key in (*ROS_TYPES, *JSON_TYPES, LOG_KEY)}
        self._channels = {
            key: foxglove.Channel(
                names[key],
                schema=foxglove.Schema(
                    name=kind, encoding="ros2msg", data=ros_schema(kind).encode()
                ),
                message_encoding="cdr",
                context=context,
            )
            for key, kind in ROS_TYPES.items()
        }
        self._channels |= {
            key: foxglove.Channel(names[key], schema=schema_of(kind), context=context)
            for key, kind in JSON_TYPES.items()
        }
        self._log = LogChannel(names[LOG_KEY], context=context)
        self._keys = {name: key for key, name in names.items()}
        self._ceiling_m = config.ceiling_m
        self._kept: dict[str, bytes] = {}
        self._fixed: dict[str, StampedTransform] = {}
        """Fixed transforms by child; robots send them in several messages, and only once."""
        self._asked: deque[str] = deque()
        """Keys that clients subscribed to, from the server's threads."""
        self._stale = set(CLOUDS)
        """Clouds that lack changes or that a client has just subscribed to."""
        self._T_map_world: Float64Array | None = None
        self._now_ns = 0
        self._forgotten = 0
        """How often the scene had been forgotten when it was last drawn."""
        self._sent_at: dict[str, float] = {}
        self._link_problem = ""
        """Why the robot is not heard; empty while it is."""
        try:
            self._server = foxglove.start_server(
                name=f"IPPON {config.robot}",
                host=config.host,
                port=config.port,
                capabilities=[Capability.Time],
                server_listener=self,
                context=context,
            )
        except (RuntimeError, OSError) as error:
            raise ViewerError(
                f"cannot serve on {config.host}:{config.port}: {error}; choose another --port"
            ) from error
        self.port = self._server.port

    def close(self) -> None:
        """End the connections."""
        self._server.stop()

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:  # noqa: ARG002
        """Note what a client wants to see; called in a thread of the server."""
        key = self._keys.get(channel.topic)
        if key is not None:
            self._asked.append(key)

    def take(self, key: str, payload: bytes) -> None:
        """Pass a message on."""
        if key == keys.EVENT:
            self._say(decode(payload, Event))
        elif key == keys.CONFIGURATION:
            self._kept.pop(BODY_KEY, None)
        if key in JSON_TYPES:
            self._send(key, payload)
        elif key == keys.MAP_ALIGNMENT:
            self._T_map_world = decode(payload, MapAlignment).as_transform()
            self._send_fixed()
        elif key == keys.TF_STATIC:
            for link in decode_transforms(payload):
                if link.child in self._fixed or len(self._fixed) < MAX_TRANSFORMS:
                    self._fixed[link.child] = link
            self._send_fixed()
        elif key == keys.TF and self._T_map_world is not None:
            self._send(key, aligned_transforms(payload, self._T_map_world))
        elif key in FORWARDED or key == keys.DEPTH_RAW:
            self._send(key, payload)
        elif key == keys.DEPTH and self._channels[keys.DEPTH_RAW].has_sinks():
            self._send_depth(payload)

    def draw(self, scene: SceneModel, changed: frozenset[Part]) -> None:
        """Serve the map, the markers and the clock."""
        self._set_clock(scene)
        self._send_again()
        if "voxels" in changed:
            self._stale |= set(CLOUDS)
        self._send_map(scene)
        if scene.body is not None and BODY_KEY not in self._kept:
            self._send(BODY_KEY, encode_body(scene.body, BASE_FRAME, self._now_ns))
        if (scene.tree is not None or scene.detections) and self._is_due(MARKERS_KEY, MARKERS_S):
            self._send(MARKERS_KEY, encode_markers(scene.tree, _finds(scene), self._now_ns))

    def show_link(self, state: LinkState, text: str) -> None:
        """Tell the clients whether the robot is heard."""
        self._link_problem = "" if state == "live" else text
        self._publish_link()
        level = LogLevel.Info if state == "live" else LogLevel.Warning
        self._log_line(text, "link", level)

    def _publish_link(self) -> None:
        if self._link_problem:
            self._server.publish_status(self._link_problem, StatusLevel.Warning, _LINK)
        else:
            self._server.remove_status([_LINK])

    def _set_clock(self, scene: SceneModel) -> None:
        # A navigator that was started again has no time before its first frame.
        now_ns = clock_ns(scene) or self._now_ns
        is_new = begins_again(now_ns, self._now_ns) or scene.forgotten != self._forgotten
        self._forgotten = scene.forgotten
        if is_new:
            logger.info("robot or navigator began again: clients forget what they have")
            for key in _OF_SESSION:
                self._kept.pop(key, None)
            self._server.clear_session()
            self._stale |= set(CLOUDS)
        if now_ns != self._now_ns:
            self._now_ns = now_ns
            self._server.broadcast_time(now_ns)
        if is_new:
            # A new navigator publishes some of it before the status by which it is noticed.
            for key, payload in self._kept.items():
                self._channels[key].log(payload, log_time=now_ns)

    def _send_again(self) -> None:
        """Send to a new client what is published on change alone."""
        asked: set[str] = set()
        while self._asked:
            asked.add(self._asked.popleft())
        if asked:
            self._publish_link()
        for key in asked:
            if key in CLOUDS:
                self._stale.add(key)
                self._sent_at.pop(key, None)
            elif key in self._kept:
                self._channels[key].log(self._kept[key], log_time=self._now_ns)

    def _send_map(self, scene: SceneModel) -> None:
        wanted = [key for key in sorted(self._stale) if self._channels[key].has_sinks()]
        due = [key for key in wanted if self._is_due(key, MAP_S)]
        if not due:
            return
        clouds = whole_maps(scene, due, self._ceiling_m, self._now_ns)
        for key, cloud in clouds.items():
            self._stale.discard(key)
            self._send(key, cloud)

    def _send_fixed(self) -> None:
        """Send all fixed transforms in one message: clients get the last message alone."""
        if not self._fixed:
            return
        payload = encode_transforms(self._fixed.values())
        if self._T_map_world is not None:
            payload = aligned_transforms(payload, self._T_map_world)
        self._send(keys.TF_STATIC, payload)

    def _send_depth(self, payload: bytes) -> None:
        try:
            self._send(keys.DEPTH_RAW, depth_image(payload))
        except MessageError as error:
            logger.debug("depth image skipped: %s", error)

    def _send(self, key: str, payload: bytes) -> None:
        if key in KEPT:
            self._kept[key] = payload
        self._channels[key].log(payload, log_time=self._now_ns)

    def _say(self, event: Event) -> None:
        level = LogLevel.Info
        if event.kind in _WARNINGS:
            level = LogLevel.Warning
        elif event.kind == "error":
            level = LogLevel.Error
        self._log_line(event.text, event.kind, level)

    def _log_line(self, text: str, name: str, level: LogLevel) -> None:
        sec, nsec = divmod(self._now_ns, 1_000_000_000)
        line = Log(timestamp=Timestamp(sec, nsec), level=level, message=text, name=name)
        self._log.log(line, log_time=self._now_ns)

    def _is_due(self, key: str, interval_s: float) -> bool:
        now = time.monotonic()
        if now - self._sent_at.get(key, -interval_s) < interval_s:
            return False
        self._sent_at[key] = now
        return True


def _finds(scene: SceneModel) -> tuple[FoundObject, ...]:
    """Return the find and the candidates."""
    report = None if scene.status is None else scene.status.find
    return scene.detections if report is None else (_found(report), *scene.detections)


def _found(report: FindReport) -> FoundObject:
    return FoundObject(
        label=report.object,
        probability=report.probability,
        center_world=report.position_world,
        size_m=report.size_m,
    )


def run_foxglove(config: FoxgloveConfig) -> None:
    """Serve until SIGINT or SIGTERM.

    Raises:
        ViewerError: The address cannot be listened on.
    """
    robot = LiveRobot(config.connect, config.robot)
    server = FoxgloveServer(config)
    logger.info("Foxglove: open a connection to ws://%s:%d", config.host, server.port)
    if config.host not in LOOPBACK:
        logger.warning(
            "whoever reaches %s:%d sees the robot's camera: Foxglove's protocol has no login",
            config.host,
            server.port,
        )
    try:
        robot.run(server, ProcessStopSignal())
    finally:
        server.close()
