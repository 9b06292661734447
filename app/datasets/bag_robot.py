"""What is told of the robot of a bag: names of topics, mount and clock of the camera, its base."""

from dataclasses import dataclass, field

from app.errors import UsageError
from app.messages.keys import BASE_FRAME, frame_name
from app.recording.channels import USUAL, Names
from app.robot_file import read_robot
from app.ros2.ippon_ros2.settings import COMPRESSED, STREAMS, Settings
from ippon.geometry import Float64Array


@dataclass(frozen=True, slots=True, kw_only=True)
class BagRobot:
    """The robot of a bag; by default one without a profile."""

    names: Names = field(default_factory=lambda: USUAL)
    """Keys of its topics, by name and type: those that its bridge carries."""
    T_base_camera: Float64Array | None = None
    """Of a fixed camera, for a bag whose tf does not say it."""
    clock_offset_s: float = 0.0
    """How far the camera's clock is behind that of its poses."""
    base: str = BASE_FRAME
    """Frame of its base."""


def read_bag_robot(profile: str | None, base_frame: str = BASE_FRAME) -> BagRobot:
    """Return what a profile says of a bag.

    Args:
        profile: Name of a built-in profile, or path of a YAML file; None without one.
        base_frame: Frame of the base, which no profile says.

    Raises:
        RobotFileError: There is no such profile, or it is invalid.
        UsageError: The name of the frame is empty.
    """
    base = frame_name(base_frame)
    if not base:
        raise UsageError("--base-frame names the frame of the base, such as base_footprint")
    if profile is None:
        return BagRobot(base=base)
    robot = read_robot(profile)
    body = robot.profile
    is_mounted = not body.can_tilt and not body.tracks_pose
    return BagRobot(
        names=_names(robot.ros2),
        T_base_camera=body.T_base_camera(body.min_tilt_rad) if is_mounted else None,
        clock_offset_s=robot.clock_offset_s,
        base=base,
    )


def _names(settings: Settings) -> Names:
    """Return the keys of a robot's topics.

    The compressed topics that image_transport puts beside an image are among them, and the raw ones
    beside a usual name. Usual names in no namespace that the profile does not name itself are left
    to the ends of names.
    """
    names: dict[tuple[str, str], str] = {}
    for stream, topic in settings.topics.items():
        usual, kinds = STREAMS.get(stream, (None, {}))
        ending = "/" + (usual or "").strip("/")
        is_usual = usual is not None and topic.name.endswith(ending)
        is_by_end = is_usual and not topic.is_named and settings.namespace == "/"
        if is_by_end and topic.name == ending:
            continue
        for kind, key in kinds.items():
            names[topic.name, kind] = key
            if is_usual:
                names[f"{topic.name.removesuffix(ending)}/{key}", kind] = key
            if kind == COMPRESSED:
                names[f"{topic.name}/{key.rsplit('/', 1)[-1]}", kind] = key
    return names
