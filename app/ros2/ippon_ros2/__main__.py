"""Runs the bridge: `python3 -m ippon_ros2 --connect tcp/NAVIGATOR:7447 --profile scout.yaml`."""

# pyright: reportMissingImports=false
from __future__ import annotations

import argparse
import faulthandler
import json
import logging
import os
import signal
import sys
import threading
import time
from pathlib import Path
from typing import Any

import zenoh

from .settings import RMW_ZENOH, Ros2Error, Settings, read_settings
from .zenoh_side import claim

logger = logging.getLogger("ippon_ros2")

ROS_ARGS = "--ros-args"
"""Begins the arguments of ROS 2."""
TICK_S = 0.02
RETRY_S = 1.0
CONNECT_S = 3.0
CHECK_S = 4.0
ALWAYS_SENT = ("color", "depth", "camera_info", "tf", "tf_static", "odom")
"""What a robot sends all the time, or has sent once; the others may be silent for long."""
LAST_S = 0.5
"""Longest time to deliver zero velocity before the node ends."""
LAST_SPINS = 4
END_S = 10.0
"""A middleware whose shutdown hangs for so long is left behind: its traces go to the log."""
LEASE_MS = 1000
NAVIGATOR_S = 5.0
"""Silence after which the navigator counts as gone."""
ZENOH_PROFILE = "IPPON_ZENOH_PROFILE"
EPILOG = """
examples:
  python3 -m ippon_ros2 --connect tcp/192.168.1.20:7447 --profile scout.yaml
  python3 -m ippon_ros2 --check --profile scout.yaml      what the robot publishes, without zenoh
  python3 -m ippon_ros2 --profile scout.yaml --ros-args -p use_sim_time:=true       in a simulator

entries of `ros2` in the profile (each a topic's name, or {topic, type, max_hz, joint, sign}):
  namespace     before names without a slash
  middleware    bridge; rmw_zenoh is for a navigator that needs no bridge
  color         camera/color/image_raw/compressed; Image or CompressedImage
  depth         camera/depth/image_raw; Image, or CompressedImage of compressedDepth
  camera_info   camera/color/camera_info
  tf, tf_static /tf, /tf_static
  odom          nav_msgs/Odometry in place of tf; the camera's mount is then the profile's
  contact, detections, masks, label_info, vision_info      not carried unless named
  cmd_vel       cmd_vel; Twist or TwistStamped, as the robot subscribes
  cmd_tilt      Float64, or JointTrajectory with `joint`; not sent unless named
  navigate      navigate_to_pose: Nav2's action, for a profile with `takes: [goals]` in `motion`
  goal          in its place a topic of PoseStamped; both take `frame`, map

The robot gets zero velocity 0.3 s after the last command. It must also stop by itself when this
program dies.
"""


class StopFlag:
    """Set by a signal handler: without a lock, which the interrupted thread could hold."""

    def __init__(self) -> None:
        self._is_set = False

    def set(self, *_: object) -> None:
        """Ask all loops to end."""
        self._is_set = True

    def is_set(self) -> bool:
        """Return whether to end."""
        return self._is_set

    def wait(self, timeout_s: float) -> bool:
        """Sleep for so long, and return whether to end."""
        if not self._is_set:
            time.sleep(timeout_s)
        return self._is_set


def main(arguments: list[str] | None = None) -> int:
    """Carry messages until SIGINT or SIGTERM; return the exit status."""
    options = _options(sys.argv[1:] if arguments is None else arguments)
    logging.basicConfig(level=logging.INFO, format="%(levelname)s %(message)s", stream=sys.stderr)
    try:
        return _start(options)
    except Ros2Error as error:
        sys.stderr.write(f"ippon_ros2: {error}\n")
        return 2


def _start(options: argparse.Namespace) -> int:
    settings = read_settings(_read_profile(options.profile))
    if settings.middleware == RMW_ZENOH:
        raise Ros2Error(
            f"the profile says `middleware: {RMW_ZENOH}`: the navigator talks to the robot's nodes "
            "itself, and this bridge would be a second one; remove that line to use the bridge"
        )
    try:
        import rclpy  # noqa: PLC0415
    except ImportError as error:
        raise Ros2Error(
            f"no ROS 2 in this Python ({error}): source /opt/ros/DISTRO/setup.bash first"
        ) from error
    stop = StopFlag()
    try:
        rclpy.init(
            args=["ippon_ros2", *options.ros_args],
            signal_handler_options=rclpy.signals.SignalHandlerOptions.NO,
        )
    except Exception as error:
        if not options.ros_args:
            raise
        raise Ros2Error(f"{' '.join(options.ros_args)}: {error}") from error
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop.set)
    try:
        return _run(options, settings, stop)
    finally:
        rclpy.try_shutdown()
        faulthandler.cancel_dump_traceback_later()


def _options(arguments: list[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="ippon_ros2", description=__doc__, epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument("--connect", default="tcp/127.0.0.1:7447", help="endpoint of the navigator")
    parser.add_argument("--robot", default="ippon", help="key prefix of the robot (%(default)s)")
    parser.add_argument("--profile", type=Path, help="the robot's YAML profile")
    parser.add_argument(
        ROS_ARGS, metavar="...", help="at the end: for ROS 2, such as -p use_sim_time:=true"
    )
    parser.add_argument("--check", action="store_true", help="show the robot's topics and end")
    at = arguments.index(ROS_ARGS) if ROS_ARGS in arguments else len(arguments)
    options = parser.parse_args(arguments[:at])
    options.ros_args = arguments[at:]
    return options


def _read_profile(path: Path | None) -> dict[str, Any]:
    if path is None:
        return {}
    import yaml  # noqa: PLC0415  # It comes with rclpy.

    try:
        text = path.read_text("utf-8")
        # With aliases, a file of a few hundred bytes holds billions of entries.
        if any(isinstance(event, yaml.AliasEvent) for event in yaml.parse(text)):
            raise Ros2Error(f"robot profile {path}: aliases (*name) are not read: write the value")
        read = yaml.safe_load(text)
    except RecursionError as error:
        raise Ros2Error(f"robot profile {path}: it is nested too deeply") from error
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise Ros2Error(f"robot profile {path}: {error}") from error
    if not isinstance(read, dict):
        raise Ros2Error(f"robot profile {path}: holds no entries")
    return read


def _run(options: argparse.Namespace, settings: Settings, stop: StopFlag) -> int:
    from .node import BridgeNode  # noqa: PLC0415

    session = _open({}) if options.check else _connect(options.connect, stop)
    if session is None:
        return 0
    try:
        token = None if options.check else _claim(session, options)
        node = BridgeNode(session, options.robot, settings)
        try:
            if options.check:
                return _check(node, stop)
            _watch_navigator(session, options.robot)
            _spin(node, stop)
        finally:
            # A look at the robot's topics stops nobody who drives it.
            if not options.check:
                node.stop()
            faulthandler.dump_traceback_later(END_S, exit=True)
            _send_the_last(node)
            node.destroy_node()
            del token
    finally:
        session.close()
    return 0


def _claim(session: zenoh.Session, options: argparse.Namespace) -> Any:
    if not os.environ.get(ZENOH_PROFILE):
        return claim(session, options.robot)
    second = _open(_to(options.connect))
    try:
        return claim(session, options.robot, second)
    finally:
        second.close()


def _to(endpoint: str) -> dict[str, Any]:
    return {
        "mode": "client",
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": round(1e3 * CONNECT_S),
        "connect/exit_on_failure": True,
    }


def _connect(endpoint: str, stop: StopFlag) -> zenoh.Session | None:
    """Return a session to the navigator, waiting for it; None once stopped."""
    said = False
    while not stop.is_set():
        try:
            return _open(_to(endpoint))
        except zenoh.ZError as error:  # noqa: PERF203
            if not said:
                # What follows in zenoh's text are places in its source.
                reason = str(error).split(" at /", 1)[0]
                logger.warning(
                    "no navigator answers at %s: waiting; is it running, and is the endpoint "
                    "right? A refused TLS certificate looks the same (%s)", endpoint, reason,
                )  # fmt: skip
            said = True
            stop.wait(RETRY_S)
    return None


def _open(settings: dict[str, Any]) -> zenoh.Session:
    """Open a session with the configuration of `IPPON_ZENOH_PROFILE`, TLS for example."""
    profile = os.environ.get(ZENOH_PROFILE)
    config = zenoh.Config.from_file(profile) if profile else zenoh.Config()
    always = {
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "scouting/delay": 0,
        "timestamping/enabled": True,
        "transport/link/tx/lease": LEASE_MS,
    }
    for key, value in {**always, **settings}.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def _watch_navigator(session: zenoh.Session, robot: str) -> None:
    there = threading.Event()

    def receive(sample: zenoh.Sample) -> None:
        here = sample.kind == zenoh.SampleKind.PUT
        if here:
            there.set()
        logger.info("the navigator is %s", "there" if here else "gone: the robot stops")

    def wait() -> None:
        if not there.wait(NAVIGATOR_S):
            logger.warning(
                "no navigator of %s is there yet: is --robot that of `ippon navigate`?", robot
            )

    handler = zenoh.handlers.Callback(receive, indirect=False)
    session.liveliness().declare_subscriber(f"{robot}/alive/navigator", handler, history=True)
    threading.Thread(target=wait, name="navigator", daemon=True).start()


def _spin(node: Any, stop: StopFlag) -> None:
    import rclpy.executors  # noqa: PLC0415

    # A thread of its own: a busy executor must not delay zero velocity.
    watchdog = threading.Thread(target=_watch, args=(node, stop), name="watchdog", daemon=True)
    watchdog.start()
    executor = rclpy.executors.SingleThreadedExecutor()
    executor.add_node(node)
    while not stop.is_set():
        executor.spin_once(timeout_sec=0.2)
    watchdog.join()


def _watch(node: Any, stop: StopFlag) -> None:
    fails = False
    while not stop.wait(TICK_S):
        try:
            node.tick()
        except Exception:  # noqa: PERF203 - the next zero velocity must leave all the same
            if not fails:
                logger.exception("the watchdog could not send")
            fails = True
        else:
            fails = False


def _send_the_last(node: Any) -> None:
    """Let zero velocity and a cancelled goal leave, whose call is made by the executor."""
    import rclpy.duration  # noqa: PLC0415
    import rclpy.executors  # noqa: PLC0415

    # What a node that ends has not delivered yet is lost.
    for publisher in node.publishers:
        publisher.wait_for_all_acked(rclpy.duration.Duration(seconds=LAST_S))
    if node.goals is None:
        return
    executor = rclpy.executors.SingleThreadedExecutor()
    executor.add_node(node)
    for _ in range(LAST_SPINS):
        executor.spin_once(timeout_sec=0.05)


def _check(node: Any, stop: StopFlag) -> int:
    """Print what each topic has; return 1 where one that is needed is missing."""
    import rclpy.executors  # noqa: PLC0415

    executor = rclpy.executors.SingleThreadedExecutor()
    executor.add_node(node)
    end = time.monotonic() + CHECK_S
    while time.monotonic() < end and not stop.is_set():
        executor.spin_once(timeout_sec=0.1)
    good, now = True, time.monotonic()
    for key, stream in node.streams.of.items():
        if stream.topic.is_optional and stream.received == 0:
            text = "nothing came, nor is it needed: the camera's pose is tracked"
            _print_line(key, stream.topic.name, text, good=True)
            continue
        if key in ALWAYS_SENT and not stream.problem and stream.received == 0:
            stream.problem = f"has a publisher, but nothing came in {CHECK_S:g} s"
        good = good and not stream.problem
        text = stream.problem or f"{stream.type}, {stream.reliability}, {stream.rates(now)}"
        _print_line(key, stream.topic.name, text, good=not stream.problem)
    for key, name, problem, kind in node.command_topics():
        good = good and not problem
        _print_line(key, name, problem or kind, good=not problem)
    return 0 if good else 1


def _print_line(key: str, topic: str, text: str, *, good: bool) -> None:
    sys.stdout.write(f"{'ok' if good else 'MISSING':<8}{key:<12}{topic}  {text}\n")


if __name__ == "__main__":
    sys.exit(main())
