"""What the bridge carries: the section `ros2` of a robot's profile."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
_TF = "tf2_msgs/msg/TFMessage"
TWIST, TWIST_STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
FLOAT, TRAJECTORY = "std_msgs/msg/Float64", "trajectory_msgs/msg/JointTrajectory"


class Ros2Error(Exception):
    """The bridge cannot run; the text says what would do."""


# Of each stream to the navigator: usual topic, None where it must be named; key of each type.
STREAMS: dict[str, tuple[str | None, dict[str, str]]] = {
    "color": (
        "camera/color/image_raw/compressed",
        {COMPRESSED: "camera/color/image_raw/compressed", IMAGE: "camera/color/image_raw"},
    ),
    "depth": (
        "camera/depth/image_raw",
        {
            IMAGE: "camera/depth/image_raw",
            COMPRESSED: "camera/depth/image_raw/compressedDepth",
        },
    ),
    "camera_info": (
        "camera/color/camera_info",
        {"sensor_msgs/msg/CameraInfo": "camera/color/camera_info"},
    ),
    "tf": ("/tf", {_TF: "tf"}),
    "tf_static": ("/tf_static", {_TF: "tf_static"}),
    "odom": (None, {"nav_msgs/msg/Odometry": "odom"}),
    "contact": (None, {"std_msgs/msg/Bool": "contact"}),
    "detections": (None, {"vision_msgs/msg/Detection2DArray": "camera/detections"}),
    "masks": (
        None,
        {IMAGE: "camera/detections/masks", COMPRESSED: "camera/detections/masks/compressed"},
    ),
    "label_info": (None, {"vision_msgs/msg/LabelInfo": "camera/detections/label_info"}),
    "vision_info": (None, {"vision_msgs/msg/VisionInfo": "camera/detections/vision_info"}),
}
POSE, NAVIGATE = "geometry_msgs/msg/PoseStamped", "nav2_msgs/action/NavigateToPose"
COMMANDS: dict[str, tuple[str | None, tuple[str, ...]]] = {
    "cmd_vel": ("cmd_vel", (TWIST, TWIST_STAMPED)),
    "cmd_tilt": (None, (FLOAT, TRAJECTORY)),
    "goal": (None, (POSE,)),
    "navigate": ("navigate_to_pose", (NAVIGATE,)),
}
GOALS = ("goal", "navigate")
"""Commands of a robot that navigates by itself: a topic, or an action."""
PUBLISHED = ("cmd_vel", "cmd_tilt")
"""Commands that are messages on a topic."""
IMAGES = ("color", "depth", "masks")
KEPT = ("tf_static", "label_info", "vision_info")
"""Streams that are sent once, to late subscribers, too (transient local)."""
_POSES = ("tf", "tf_static")
NO_HEADER = ("tf", "tf_static", "contact")
"""Streams whose messages have no stamp of their own, so that their rate is not limited."""

BRIDGE, RMW_ZENOH = "bridge", "rmw_zenoh"
_LINK = ("namespace", "middleware", "domain", "router")
"""Entries of the section that name no topic."""
MOST_DOMAINS = 233


@dataclass
class Topic:
    """One topic of the robot."""

    name: str
    type: str | None = None
    """ROS 2 type; None for what the robot's nodes have."""
    max_hz: float = 0.0
    """Images beyond this rate are left out; 0 for all."""
    joint: str = ""
    """Joint of the camera's tilt in a trajectory."""
    sign: float = 1.0
    """-1 where a larger joint angle looks down."""
    frame: str = ""
    """Coordinate frame of goals; empty for `map`."""
    compress: bool = False
    """Raw depth goes as PNG, without loss."""
    is_named: bool = False
    """The profile names it, and does not leave it to what is usual."""
    is_optional: bool = False
    """Nobody needs to publish it: tf of a camera whose pose the navigator tracks."""


@dataclass
class Settings:
    """What to carry."""

    topics: dict[str, Topic]
    max_linear_m_s: float = math.inf
    max_yaw_rate_rad_s: float = math.inf
    middleware: str = BRIDGE
    """`bridge`, or `rmw_zenoh` for a navigator that talks to the robot's nodes itself."""
    domain: int = 0
    """ROS domain of nodes with rmw_zenoh."""
    router: str = ""
    """zenoh endpoint of the robot's router; empty where it connects to the navigator."""
    namespace: str = "/"


def read_settings(profile: dict[str, Any]) -> Settings:
    """Return the topics that a robot's profile names, and its limits of speed.

    Args:
        profile: The YAML file, read.

    Raises:
        Ros2Error: An entry is unknown or has no sensible value.
    """
    section = profile.get("ros2") or {}
    if not isinstance(section, dict):
        raise Ros2Error(
            f"`ros2` in the profile holds entries such as `color: TOPIC`; got {section!r}"
        )
    known = [*STREAMS, *COMMANDS]
    unknown = [key for key in section if key not in known and key not in _LINK]
    if unknown:
        may = ", ".join((*_LINK, *known))
        raise Ros2Error(f"`ros2` in the profile has {unknown[0]!r}; it may have {may}")
    namespace = "/" + str(section.get("namespace") or "").strip("/")
    middleware, domain, router = _read_link(section)
    usual = {key: entry[0] for key, entry in (*STREAMS.items(), *COMMANDS.items())}
    if "odom" in section:
        usual["tf"] = usual["tf_static"] = None
    motion = profile.get("motion") or {}
    if not isinstance(motion, dict):
        raise Ros2Error(f"`motion` in the profile holds entries; got {motion!r}")
    _read_takes(section, motion, usual)
    camera = profile.get("camera")
    tracks_pose = isinstance(camera, dict) and camera.get("pose") == "tracked"
    topics: dict[str, Topic] = {}
    for key in known:
        entry = section.get(key, usual[key])
        if entry is not None:
            topics[key] = _topic(key, entry, namespace)
            topics[key].is_named = key in section
            topics[key].is_optional = tracks_pose and key in _POSES and key not in section
    return Settings(
        topics,
        _limit(motion, "max_speed_m_s"),
        math.radians(_limit(motion, "max_turn_deg_s")),
        middleware,
        domain,
        router,
        namespace,
    )


def _limit(motion: dict[str, Any], name: str) -> float:
    """Return a limit of speed; infinity where the profile has none.

    Raises:
        Ros2Error: It is no number above 0: with a negative one a stop would be a drive.
    """
    limit = _number(motion.get(name, math.inf))
    if not limit > 0.0:
        raise Ros2Error(f"`motion: {name}` is a number above 0; got {motion[name]!r}")
    return limit


def _number(value: Any) -> float:
    """Return a number of the profile; NaN for what is none."""
    try:
        return math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan


def _read_link(section: dict[str, Any]) -> tuple[str, int, str]:
    """Return middleware, domain and router.

    Raises:
        Ros2Error: One of them has no sensible value.
    """
    middleware, domain = section.get("middleware", BRIDGE), section.get("domain", 0)
    router = section.get("router", "")
    if middleware not in (BRIDGE, RMW_ZENOH):
        raise Ros2Error(
            f"`ros2: middleware` is {BRIDGE} or {RMW_ZENOH}; got {middleware!r}. {BRIDGE} is for "
            "`ippon ros2`, with any middleware, and for zenoh-bridge-ros2dds"
        )
    if middleware == BRIDGE and ("domain" in section or "router" in section):
        raise Ros2Error(
            f"`ros2: domain` and `ros2: router` are for `middleware: {RMW_ZENOH}`; a bridge takes "
            "the domain from ROS_DOMAIN_ID"
        )
    if not isinstance(domain, int) or isinstance(domain, bool) or not 0 <= domain < MOST_DOMAINS:
        raise Ros2Error(f"`ros2: domain` is a number from 0 to {MOST_DOMAINS - 1}; got {domain!r}")
    if not isinstance(router, str) or (router and "/" not in router):
        raise Ros2Error(
            f"`ros2: router` is a zenoh endpoint such as tcp/192.168.1.30:7447; got {router!r}"
        )
    return middleware, domain, router


def _read_takes(
    section: dict[str, Any], motion: dict[str, Any], usual: dict[str, str | None]
) -> None:
    """Set the usual names of the commands that the robot takes.

    Raises:
        Ros2Error: Topics and `takes` contradict each other.
    """
    takes = motion.get("takes", ["velocities"])
    if not isinstance(takes, list | tuple):
        raise Ros2Error(f"`motion: takes` is a list such as [velocities]; got {takes!r}")
    named = [key for key in GOALS if section.get(key)]
    if len(named) > 1:
        raise Ros2Error("`ros2` in the profile has `goal` and `navigate`: give one of them")
    if named and "goals" not in takes:
        raise Ros2Error(
            f"`ros2: {named[0]}` is for robots that navigate by themselves: write "
            "`takes: [goals]` in `motion`"
        )
    if "goals" not in takes or "goal" in named:
        usual["navigate"] = None
    if "velocities" not in takes:
        if section.get("cmd_vel"):
            raise Ros2Error("`ros2: cmd_vel` needs `takes: [goals, velocities]` in `motion`")
        usual["cmd_vel"] = None


def _topic(key: str, entry: Any, namespace: str) -> Topic:
    if not isinstance(entry, str | dict):
        raise Ros2Error(f"`ros2: {key}` is a topic, or {{topic: NAME, ...}}; got {entry!r}")
    fields = {"topic": entry} if isinstance(entry, str) else dict(entry)
    usual = STREAMS[key][0] if key in STREAMS else COMMANDS[key][0]
    name = fields.pop("topic", usual)
    frame = str(fields.pop("frame", "")) if key in GOALS else ""
    kind = fields.pop("type", None)
    types = tuple(STREAMS[key][1]) if key in STREAMS else COMMANDS[key][1]
    if kind is not None and kind not in types:
        raise Ros2Error(f"`ros2: {key}` has type {kind!r}; it may be {' or '.join(types)}")
    if not isinstance(name, str) or not name:
        raise Ros2Error(f"`ros2: {key}` names no topic")
    max_hz = _number(fields.pop("max_hz", 0.0))
    compress = fields.pop("compress", False) if key == "depth" else False
    joint, sign = str(fields.pop("joint", "")), _number(fields.pop("sign", 1.0))
    if fields or not 0.0 <= max_hz < math.inf or abs(sign) != 1.0 or not isinstance(compress, bool):
        raise Ros2Error(
            f"`ros2: {key}` takes topic, type, max_hz, for depth compress (true or false), for a "
            f"trajectory joint and sign (1 or -1), and for goals frame; got {entry!r}"
        )
    if max_hz and key in NO_HEADER:
        raise Ros2Error(
            f"`ros2: {key}` takes no max_hz: its messages have no stamp by which some are left "
            "out. Limit color and depth, which need the most of a network"
        )
    if key == "cmd_tilt" and kind == TRAJECTORY and not joint:
        raise Ros2Error("`ros2: cmd_tilt` with a JointTrajectory needs `joint`: NAME")
    if not name.startswith("/"):
        name = f"{namespace.rstrip('/')}/{name}"
    return Topic(name, kind, max_hz, joint, sign, frame, compress)
