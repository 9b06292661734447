"""Robot profiles as YAML files, in metres and degrees.

A profile describes body and camera of a robot, from which the planner derives clearance and
visibility. `template` writes a file with every line explained.
"""

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal

import msgspec
import yaml

from app.ros2.ippon_ros2.settings import RMW_ZENOH, Ros2Error, Settings, read_settings
from app.yaml_text import parse_yaml
from ippon import extensions
from ippon.mapping.config import MapConfig
from ippon.robot import HABITAT, ZED, CollisionSphere, RobotProfile, upright_body

PROFILES: Final = {profile.name: profile for profile in (ZED, HABITAT)}
"""Built-in profiles by name."""
SHIPPED: Final = {
    path.stem: path for path in sorted((Path(__file__).parent / "profiles").glob("*.yaml"))
}
"""Files of profiles that come with the program, by name."""
MOST_BYTES: Final = 100_000
MOST_OFFSET_MS: Final = 1000.0
_MAP: Final = MapConfig()


class RobotFileError(ValueError):
    """A profile cannot be used; the text says where and why."""


class _Part(msgspec.Struct, forbid_unknown_fields=True):
    pass


class _Sphere(_Part, kw_only=True):
    x_m: float = 0.0
    y_m: float = 0.0
    z_m: float
    radius_m: float


class _Body(_Part, kw_only=True):
    radius_m: float | None = None
    height_m: float | None = None
    clearance_m: float | None = None
    spheres: tuple[_Sphere, ...] = ()
    max_step_m: float = ZED.max_step_m


class _Motion(_Part, kw_only=True):
    max_speed_m_s: float
    max_turn_deg_s: float
    acceleration_m_s2: float = ZED.max_linear_acceleration_m_s2
    turn_acceleration_deg_s2: float = math.degrees(ZED.max_yaw_acceleration_rad_s2)
    can_reverse: bool = ZED.can_reverse
    takes: tuple[Literal["velocities", "goals"], ...] = ("velocities",)


class _Tilt(_Part, kw_only=True):
    lowest_deg: float
    highest_deg: float
    max_deg_s: float


class _Camera(_Part, kw_only=True):
    height_m: float
    forward_m: float = ZED.camera_forward_m
    horizontal_fov_deg: float
    width_over_height: float
    min_depth_m: float = ZED.min_depth_m
    max_depth_m: float = ZED.max_depth_m
    tilt: _Tilt | float
    clock_offset_ms: float = 0.0
    pose: Literal["tf", "tracked"] = "tf"


class _Detector(_Part, kw_only=True):
    source: str = ""
    labels: dict[str, str] = {}


class _RobotFile(_Part, kw_only=True):
    name: str
    body: _Body
    motion: _Motion
    camera: _Camera
    detector: _Detector | None = None
    ros2: dict[str, Any] | None = None
    """Read by the bridge on the robot, or by the navigator for nodes with rmw_zenoh."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectorTable:
    """How to interpret the detections of a robot."""

    source: str = ""
    """Name of its network, which selects its observation model; empty for the name that it
    sends."""
    labels: dict[str, str] = field(default_factory=dict[str, str])
    """Labels of those of its class names that are not labels or synonyms."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Robot:
    """All that the profile of a robot says."""

    profile: RobotProfile
    detector: DetectorTable = field(default_factory=DetectorTable)
    clock_offset_s: float = 0.0
    """How far the camera's clock is behind that of the poses."""
    ros2: Settings = field(default_factory=lambda: read_settings({}))
    """Its ROS 2 topics."""

    @property
    def rmw_zenoh(self) -> Settings | None:
        """Its topics, if its middleware is rmw_zenoh; else None."""
        return self.ros2 if self.ros2.middleware == RMW_ZENOH else None


def read_profile(text: str) -> RobotProfile:
    """Return body and camera of a robot, as `read_robot`."""
    return read_robot(text).profile


def read_robot(text: str) -> Robot:
    """Return what a profile says.

    Args:
        text: Name of a built-in or shipped profile, or path of a YAML file.

    Raises:
        RobotFileError: There is no such profile, or it is invalid.
    """
    if text in PROFILES:
        return Robot(profile=PROFILES[text])
    file = _read(text)
    try:
        return Robot(
            profile=_profile(file),
            detector=_detector(file.detector),
            clock_offset_s=_clock_offset_s(file.camera),
            ros2=_settings(file),
        )
    except ValueError as error:
        raise RobotFileError(f"robot profile {text}: {error}") from error


def _detector(detector: _Detector | None) -> DetectorTable:
    if detector is None:
        return DetectorTable()
    if not all(detector.labels) or not all(detector.labels.values()):
        raise ValueError("detector.labels has an empty name or label")
    return DetectorTable(source=detector.source, labels=detector.labels)


def _clock_offset_s(camera: _Camera) -> float:
    if not abs(camera.clock_offset_ms) <= MOST_OFFSET_MS:
        raise ValueError(
            f"camera.clock_offset_ms is {camera.clock_offset_ms:g}; it may be -"
            f"{MOST_OFFSET_MS:g} to {MOST_OFFSET_MS:g}: synchronise clocks that are further apart"
        )
    return camera.clock_offset_ms / 1e3


def profile_names() -> tuple[str, ...]:
    """Return the names of all profiles: built-in, shipped, and of installed packages."""
    return (*PROFILES, *SHIPPED, *extensions.names(extensions.PROFILES))


def _read(text: str) -> _RobotFile:
    path = SHIPPED.get(text) or Path(text)
    if text not in SHIPPED and text in extensions.names(extensions.PROFILES):
        try:
            path = Path(extensions.load(extensions.PROFILES, text))
        except (extensions.ExtensionError, TypeError) as error:
            raise RobotFileError(f"robot profile {text}: {error}") from error
    if not path.is_file():
        raise RobotFileError(
            f"no robot profile {text!r}: give {', '.join(profile_names())} or a YAML file; "
            "`ippon profile` prints one to start from"
        )
    if (size := path.stat().st_size) > MOST_BYTES:
        raise RobotFileError(f"{path} is too long for a robot profile: {size} bytes")
    try:
        file = msgspec.convert(parse_yaml(path.read_text("utf-8")), _RobotFile)
        _settings(file)
    except (OSError, yaml.YAMLError, ValueError, Ros2Error) as error:
        raise RobotFileError(f"robot profile {path}: {error}") from error
    return file


def _settings(file: _RobotFile) -> Settings:
    """Return the topics of a robot and its limits; raises Ros2Error."""
    motion, camera = msgspec.to_builtins(file.motion), msgspec.to_builtins(file.camera)
    return read_settings({"ros2": file.ros2, "motion": motion, "camera": camera})


def map_config(
    profile: RobotProfile, voxel_size_m: float, memory_limit_mb: float = _MAP.memory_limit_mb
) -> MapConfig:
    """Return a map configuration for the robot's depth range; raises ValueError."""
    return MapConfig(
        voxel_size_m=voxel_size_m,
        memory_limit_mb=memory_limit_mb,
        min_range_m=profile.min_depth_m,
        max_range_m=profile.max_depth_m,
        max_valid_depth_m=max(_MAP.max_valid_depth_m, profile.max_depth_m),
    )


def _profile(file: _RobotFile) -> RobotProfile:
    camera, motion = file.camera, file.motion
    tilt = camera.tilt
    if not isinstance(tilt, _Tilt):
        tilt = _Tilt(lowest_deg=tilt, highest_deg=tilt, max_deg_s=60.0)
    return RobotProfile(
        name=file.name,
        spheres=_spheres(file.body),
        max_linear_m_s=motion.max_speed_m_s,
        max_yaw_rate_rad_s=math.radians(motion.max_turn_deg_s),
        max_tilt_rate_rad_s=math.radians(tilt.max_deg_s),
        max_linear_acceleration_m_s2=motion.acceleration_m_s2,
        max_yaw_acceleration_rad_s2=math.radians(motion.turn_acceleration_deg_s2),
        min_tilt_rad=math.radians(tilt.lowest_deg),
        max_tilt_rad=math.radians(tilt.highest_deg),
        camera_height_m=camera.height_m,
        camera_forward_m=camera.forward_m,
        horizontal_fov_rad=math.radians(camera.horizontal_fov_deg),
        image_aspect=camera.width_over_height,
        min_depth_m=camera.min_depth_m,
        max_depth_m=camera.max_depth_m,
        max_step_m=file.body.max_step_m,
        can_reverse=motion.can_reverse,
        takes_velocities="velocities" in motion.takes,
        takes_goals="goals" in motion.takes,
        tracks_pose=camera.pose == "tracked",
    )


def _spheres(body: _Body) -> tuple[CollisionSphere, ...]:
    if body.spheres:
        if (body.radius_m, body.height_m, body.clearance_m) != (None, None, None):
            raise ValueError("a body is spheres, or radius_m, height_m and clearance_m; not both")
        return tuple(
            CollisionSphere(x_m=s.x_m, y_m=s.y_m, z_m=s.z_m, radius_m=s.radius_m)
            for s in body.spheres
        )
    if body.radius_m is None or body.height_m is None or body.clearance_m is None:
        raise ValueError("a body needs radius_m, height_m and clearance_m, or spheres")
    if not (0.0 < body.radius_m < math.inf and 0.0 <= body.clearance_m < body.height_m < math.inf):
        raise ValueError(
            "radius_m must be positive and clearance_m from 0 to below height_m; got "
            f"{body.radius_m:g}, {body.clearance_m:g} and {body.height_m:g}"
        )
    return upright_body(body.radius_m, body.height_m, body.clearance_m)


def template(profile: RobotProfile) -> str:
    """Return a profile as YAML for `read_profile`, every line explained."""
    spheres = "".join(
        f"    - {{x_m: {s.x_m:g}, y_m: {s.y_m:g}, z_m: {s.z_m:.4g}, radius_m: {s.radius_m:g}}}\n"
        for s in profile.spheres
    )

    def degrees(angle: float) -> str:
        return f"{math.degrees(angle):.4g}"

    tilt = f"  tilt: {degrees(profile.min_tilt_rad)}  # fixed; degrees above the horizon\n"
    if profile.can_tilt:
        tilt = f"""  tilt:  # for a fixed camera, a number of degrees instead of these three
    lowest_deg: {degrees(profile.min_tilt_rad)}  # negative is down
    highest_deg: {degrees(profile.max_tilt_rad)}
    max_deg_s: {degrees(profile.max_tilt_rate_rad_s)}
"""
    return (
        f"""# A robot profile for `ippon navigate --profile FILE`; metres, seconds, degrees.
name: {profile.name}

body:
  # Spheres that enclose the body, relative to the centre of the base on the floor: x ahead, y
  # to the left, z up. Alternatively an upright cylinder:
  #   radius_m: 0.25
  #   height_m: 1.2
  #   clearance_m: 0.06   # height that the body drives over
  spheres:
{spheres}  max_step_m: {profile.max_step_m:g}  # highest step up; as much down is a drop

motion:
  max_speed_m_s: {profile.max_linear_m_s:g}
  max_turn_deg_s: {degrees(profile.max_yaw_rate_rad_s)}
  acceleration_m_s2: {profile.max_linear_acceleration_m_s2:g}
  turn_acceleration_deg_s2: {degrees(profile.max_yaw_acceleration_rad_s2)}
  can_reverse: {str(profile.can_reverse).lower()}
  takes: [{_takes(profile)}]  # velocities; goals, for a robot that navigates by itself; or both

camera:
  height_m: {profile.camera_height_m:g}  # height of its tilt axis above the floor
  forward_m: {profile.camera_forward_m:g}  # its tilt axis ahead of the centre of the base
  horizontal_fov_deg: {degrees(profile.horizontal_fov_rad)}
  width_over_height: {profile.image_aspect:g}  # of its images
  min_depth_m: {profile.min_depth_m:g}  # range of valid depth
  max_depth_m: {profile.max_depth_m:g}
  clock_offset_ms: 0  # of the camera's clock behind that of the poses (`ippon doctor --robot`)
  pose: {"tracked" if profile.tracks_pose else "tf"}  # tracked: found by the images, without tf
{tilt}"""
        + _OPTIONAL
    )


def _takes(profile: RobotProfile) -> str:
    kinds = {"velocities": profile.takes_velocities, "goals": profile.takes_goals}
    return ", ".join(kind for kind, taken in kinds.items() if taken)


_OPTIONAL: Final = """
# A detector on the robot whose class names differ from the labels:
# detector:
#   source: yolo11n   # network, selects the observation model; default: the name it sends
#   labels:
#     coffee mug: cup

# ROS 2 topics for `ippon ros2` on the robot, if they differ from the defaults:
# ros2:
#   middleware: rmw_zenoh   # its nodes have it: no bridge is needed; otherwise leave it out
#   domain: 0                   # ROS domain of those nodes,
#   router: tcp/scout:7447      # and their router; without it that one connects to the navigator
#   namespace: /scout   # before names without a slash
#   color: {topic: camera/color/image_raw, max_hz: 10}   # Image or CompressedImage
#   depth: {topic: camera/aligned_depth_to_color/image_raw, max_hz: 10}
#   camera_info: camera/color/camera_info
#   odom: odom          # instead of tf; the camera is then mounted as above
#   cmd_vel: cmd_vel    # Twist or TwistStamped, as the robot subscribes
#   navigate: navigate_to_pose   # action of a robot that takes goals; or a topic:
#   goal: goal_pose     # geometry_msgs/PoseStamped
#   cmd_tilt:
#     {topic: head/command, type: trajectory_msgs/msg/JointTrajectory, joint: head_tilt}
"""
"""Optional sections of a profile."""
