"""`ippon profile`: prints, checks and draws a robot's profile."""

import math
import sys
from typing import TYPE_CHECKING

from app.cli.options.tools import Profile
from app.cli.tools.save_picture import save_picture
from app.errors import UsageError
from app.robot_file import PROFILES, SHIPPED, RobotFileError, read_profile, template

if TYPE_CHECKING:
    from ippon.robot import RobotProfile


def run_profile(command: Profile) -> int:
    """Print a built-in profile as YAML, a robot's own, or a summary of the user's profile."""
    if command.from_robot is not None:
        if command.picture is not None:
            raise UsageError(
                "--picture draws a profile that is there: write that of the robot to a file first, "
                "then `ippon profile scout.yaml --picture scout.png`"
            )
        from app.cli.setup.profile_from_robot import profile_from_robot

        print(profile_from_robot(command.from_robot, command.connect), end="")
        return 0
    try:
        profile = read_profile(command.profile)
    except RobotFileError as error:
        raise UsageError(str(error)) from error
    if command.profile in PROFILES:
        print(template(profile), end="")
    elif command.profile in SHIPPED:
        print(SHIPPED[command.profile].read_text("utf-8"), end="")
    else:
        print(summary(profile))
    if command.picture is not None:
        from app.cli.setup.profile_picture import draw_profile

        save_picture(draw_profile(profile), command.picture)
        print(f"{command.picture}: body and view", file=sys.stderr)
    return 0


def summary(profile: "RobotProfile") -> str:
    """Return a summary of a profile in a few lines."""
    bottom = min(s.z_m - s.radius_m for s in profile.spheres)
    span = f"{bottom:.2f} to {profile.height_m:.2f}"
    wide = 2.0 * max(abs(s.y_m) + s.radius_m for s in profile.spheres)
    floor_m = profile.floor_in_view_m
    near = "no floor within its range at any tilt: it will not drive"
    if floor_m < math.inf:
        near = f"the floor from {floor_m:.2f} m ahead of its centre"
    tilt = f"{math.degrees(profile.min_tilt_rad):.0f}"
    if profile.can_tilt:
        tilt += f" to {math.degrees(profile.max_tilt_rad):.0f}"
    sight = (
        f"{math.degrees(profile.horizontal_fov_rad):.0f} x "
        f"{math.degrees(profile.vertical_fov_rad):.0f} degrees, tilt {tilt} degrees"
    )
    turn_s = 2.0 * math.pi / profile.max_yaw_rate_rad_s
    reverse = "may" if profile.can_reverse else "must not"
    rows = {
        "body": f"{len(profile.spheres)} spheres, {span} m above the floor",
        "width": f"{wide:.2f} m; turns on the spot in a circle of {2.0 * profile.radius_m:.2f} m",
        "steps": f"up to {100.0 * profile.max_step_m:.0f} cm; a higher drop is not floor",
        "speed": f"{profile.max_linear_m_s:g} m/s, full turn in {turn_s:.1f} s, {reverse} reverse",
        "camera": f"{profile.camera_height_m:g} m high, {sight}",
        "depth": f"{profile.min_depth_m:g} to {profile.max_depth_m:g} m",
        "sees": near,
    }
    return "\n".join([profile.name, *(f"  {name:<8}{text}" for name, text in rows.items())])
