"""`ippon profile --from-robot`: reads the camera of a live robot and asks for the rest."""

import json
import sys
from collections.abc import Callable
from typing import Final

from app.cli.tools.navigator_address import find_navigator
from app.doctor.robot.measured_camera import MeasuredCamera, UnmeasuredError, measure_camera
from app.doctor.robot.samples import listen
from app.errors import UsageError
from app.links.network.session import LinkError, open_client

Ask = Callable[[str], str]
QUESTIONS: Final = {
    "radius_m": ("radius of a circle around the centre that holds the body, m", 0.25),
    "body_height_m": ("height of the body with everything on it, m", 1.2),
    "clearance_m": ("height above the floor that it drives over, m", 0.05),
    "max_speed_m_s": ("top speed for a search, m/s", 0.5),
    "max_turn_deg_s": ("top turn rate for a search, degrees/s", 60.0),
    "min_depth_m": ("nearest valid depth, m", 0.3),
    "max_depth_m": ("farthest depth to rely on, m", 4.0),
}
"""Text and usual answer of what a robot does not say."""
MOUNT: Final = {
    "camera_height_m": ("height of the camera above the floor, m", 1.0),
    "forward_m": ("camera ahead of the centre, m", 0.0),
    "tilt_deg": ("tilt of the camera above the horizon, degrees", -10.0),
}
"""The same of what tf says where there is one."""


def profile_from_robot(robot: str, connect: str | None) -> str:
    """Listen to a robot for a few seconds and return its profile as YAML.

    Questions go to the terminal; without one, the usual answers are taken and marked.

    Raises:
        UsageError: No navigator is running, named or answering, or the robot sends no intrinsics.
    """
    endpoint, prefix = find_navigator(connect, robot)
    try:
        with open_client(endpoint) as session:
            samples = listen(session, prefix)
        measured = measure_camera(samples)
    except (LinkError, UnmeasuredError) as error:
        raise UsageError(str(error)) from error
    ask = _ask_terminal if sys.stdin.isatty() else None
    return write_profile(prefix.rsplit("/", 1)[-1], measured, ask)


def write_profile(name: str, measured: MeasuredCamera, ask: Ask | None) -> str:
    """Return a profile as YAML, each line with its origin.

    Args:
        name: Of the robot.
        measured: Its camera.
        ask: Returns the answer to a question, empty for the usual one; None asks nobody.
    """
    known = {
        "camera_height_m": measured.height_m,
        "forward_m": measured.forward_m,
        "tilt_deg": measured.tilt_deg,
    }
    lines = {key: f"{_rounded(value)}  # read" for key, value in known.items() if value is not None}
    questions = {**QUESTIONS, **{key: MOUNT[key] for key in MOUNT if key not in lines}}
    for key, (text, usual) in questions.items():
        lines[key] = _answer(text, usual, ask)
    aside = ""
    if abs(measured.left_m) > 0.02:
        aside = f"  # It is {measured.left_m:.2f} m to the left; it is taken to be in the middle.\n"
    return f"""# Read: from the robot's messages. Answered: by you. Typical: measure it.
name: {json.dumps(name)}

body:
  radius_m: {lines["radius_m"]}
  height_m: {lines["body_height_m"]}
  clearance_m: {lines["clearance_m"]}

motion:
  max_speed_m_s: {lines["max_speed_m_s"]}
  max_turn_deg_s: {lines["max_turn_deg_s"]}

camera:  # images of {measured.width} x {measured.height}
{aside}  height_m: {lines["camera_height_m"]}
  forward_m: {lines["forward_m"]}
  horizontal_fov_deg: {measured.horizontal_fov_deg:.4g}  # read
  width_over_height: {measured.width_over_height:.4g}  # read
  min_depth_m: {lines["min_depth_m"]}
  max_depth_m: {lines["max_depth_m"]}
  tilt: {lines["tilt_deg"]}
"""


def _rounded(value: float) -> str:
    """Three digits of a length or an angle, and none below a thousandth."""
    return f"{round(value, 3) + 0.0:.3g}"


def _answer(text: str, usual: float, ask: Ask | None) -> str:
    """Return a number with its origin; asks again until the answer is one."""
    while ask is not None:
        answer = ask(f"{text} [{usual:g}]: ").strip()
        if not answer:
            break
        try:
            return f"{float(answer):g}  # answered"
        except ValueError:
            print(f"a number is needed; got {answer!r}", file=sys.stderr)
    return f"{usual:g}  # typical"


def _ask_terminal(text: str) -> str:
    print(text, end="", file=sys.stderr, flush=True)
    return sys.stdin.readline()
