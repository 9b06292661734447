"""What the profile of its robot says of a bag: names of topics, and the mount of the camera."""

from app.recording.channels import Names
from app.robot_file import read_clock_offset, read_profile, read_ros2
from app.ros2.ippon_ros2.settings import COMPRESSED, STREAMS
from ippon.geometry import Float64Array


def read_names(profile: str | None) -> Names:
    """Return the keys of a robot's topics, by name and type: those that its bridge carries.

    The compressed topics that image_transport puts beside an image are among them, and the raw ones
    beside a usual name. Topics with usual names in no namespace are left to the ends of names.

    Args:
        profile: Name of a built-in profile, or path of a YAML file; None for no names.

    Raises:
        RobotFileError: There is no such profile, or it is invalid.
    """
    names: dict[tuple[str, str], str] = {}
    if profile is None:
        return names
    settings = read_ros2(profile)
    for stream, topic in settings.topics.items():
        usual, kinds = STREAMS.get(stream, (None, {}))
        ending = "/" + (usual or "").strip("/")
        is_usual = usual is not None and topic.name.endswith(ending)
        if is_usual and topic.name == ending and settings.namespace == "/":
            continue
        for kind, key in kinds.items():
            names[topic.name, kind] = key
            if is_usual:
                names[f"{topic.name.removesuffix(ending)}/{key}", kind] = key
            if kind == COMPRESSED:
                names[f"{topic.name}/{key.rsplit('/', 1)[-1]}", kind] = key
    return names


def read_offset(profile: str | None) -> float:
    """Return how far a robot's camera clock is behind that of its poses, seconds.

    Args:
        profile: Name of a built-in profile, or path of a YAML file; None for no offset.

    Raises:
        RobotFileError: There is no such profile, or it is invalid.
    """
    return 0.0 if profile is None else read_clock_offset(profile)


def read_mount(profile: str | None) -> Float64Array | None:
    """Return T_base_camera of a robot with a fixed camera, for a bag whose tf does not say it.

    Args:
        profile: Name of a built-in profile, or path of a YAML file; None for no mount.

    Raises:
        RobotFileError: There is no such profile, or it is invalid.
    """
    robot = None if profile is None else read_profile(profile)
    if robot is None or robot.can_tilt or robot.tracks_pose:
        return None
    return robot.T_base_camera(robot.min_tilt_rad)
