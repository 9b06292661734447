"""The simulated robot as a process: publishes camera and pose, follows velocity commands."""

import contextlib
import logging
import queue
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

import msgspec
import zenoh

from app.links.network.last_messages import request_when_seen
from app.links.network.latched_topic import LatchedReceiver
from app.links.network.requests import last_message
from app.links.network.session import open_client
from app.links.network.subscription import subscribe
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.control import decode as decode_json
from app.messages.depth.depth_images import encode_depth
from app.messages.images import encode_camera, encode_color
from app.messages.keys import CAMERA_FRAME
from app.messages.motion import (
    StampedTwist,
    decode_number,
    decode_twist,
    encode_flag,
    encode_transforms,
    robot_transforms,
)
from app.messages.navigation import encode_goal_status
from app.messages.perception.heatmaps import encode_heatmap
from app.messages.status import SegmentationLabels
from app.nodes.simulated_drive import SimulatedDrive, Speed
from app.nodes.simulated_goals import SimulatedGoals
from app.process.stop_signal import ProcessStopSignal, StopSignal
from ippon.command import Command
from ippon.frame import NANOSECONDS, Frame
from ippon.guidance.language.naming import is_instance_of
from ippon.robot import ZED, RobotProfile
from ippon.seed import check_seed
from ippon.simulation.robot.mobile_base import BaseConfig, camera_of
from ippon.simulation.scene import Scene, StartPose
from ippon.simulation.world import SimulatedWorld, WorldConfig

logger = logging.getLogger(__name__)

PHYSICS_HZ: Final = 50.0
TF_HZ: Final = 25.0
WATCHDOG_S: Final = 0.25
"""Silence after which the robot brakes, so that it stands 0.5 s after the last command."""
LABELS_WAIT_S: Final = 300.0
"""A navigator's first start compiles, which takes minutes on a busy machine."""
SILENT_WAIT_S: Final = 5.0
"""Time after which a wait for the navigator is told."""
ANSWER_WAIT_S: Final = 30.0
"""Time without an answer, in lock-step, after which the navigator counts as gone."""


class SimulatedRobotError(Exception):
    """The simulated robot cannot continue; the text says why."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotSimConfig:
    """Endpoint of the navigator, and speed and camera of the simulation."""

    connect: str
    robot: str
    profile: RobotProfile = ZED
    speed: Literal["1", "2", "max"] = "1"
    seed: int = 0
    rate_hz: float = 5.0
    """Frames per simulated second."""
    image_width: int = 400
    """Pixels; the height follows from the robot's camera."""

    def __post_init__(self) -> None:
        """Refuse cameras that cannot be simulated, and an invalid seed."""
        keys.check_prefix(self.robot)
        check_seed(self.seed)
        if not 0.5 <= self.rate_hz <= PHYSICS_HZ:
            raise ValueError(
                f"the camera takes 0.5 to {PHYSICS_HZ:g} frames a second; got {self.rate_hz:g}"
            )
        if self.profile.follows_goals and self.speed == "max":
            raise ValueError(
                "a robot that takes goals drives in its own time: simulate it at speed 1 or 2"
            )
        if not 32 <= self.image_width <= 1920:
            raise ValueError(f"images are 32 to 1920 pixels wide; got {self.image_width}")


class GroundTruth(msgspec.Struct, frozen=True, kw_only=True):
    """Ground truth for scoring: the reply on `sim/truth`."""

    trajectory: list[tuple[float, float, float]]
    collisions: int
    frames: int
    stamp_ns: int
    speeds: list[Speed] = []
    """Of each physics step of the last two minutes."""


class RobotSim:
    """Steps the simulated world and exchanges messages with the navigator."""

    def __init__(
        self, config: RobotSimConfig, session: zenoh.Session, scene: Scene, start: StartPose
    ) -> None:
        profile = config.profile
        camera = camera_of(profile, config.image_width)
        world = WorldConfig(base=BaseConfig(command_timeout_s=WATCHDOG_S))
        self.world = SimulatedWorld(
            scene, profile, camera, start, config.seed, world, is_instance_of
        )
        self._config = config
        self._session = session
        self._lock = threading.Lock()
        self._tilt_rad = self.world.base.tilt_rad
        self._drive = SimulatedDrive(1.0 if config.speed == "max" else float(config.speed))
        self._answers: queue.SimpleQueue[StampedTwist] = queue.SimpleQueue()
        self._labels: SegmentationLabels | None = None
        self._goals = SimulatedGoals()
        self._publishers: dict[str, zenoh.Publisher] = {}
        self._subscribe(keys.CMD_VEL, self._on_twist)
        self._subscribe(keys.CMD_TILT, self._on_tilt)
        if profile.follows_goals:
            self._subscribe(keys.NAVIGATION_GOAL, self._goals.take_goal)
            self._subscribe(keys.NAVIGATION_ACTIVE, self._goals.take_active)
        self._latched = LatchedReceiver(_skipping_malformed(keys.LABELS, self._take_labels))
        subscribe(session, self._key(keys.LABELS), self._latched.receive)
        request_when_seen(session, config.robot, {keys.LABELS: self._latched})
        self._truth = session.declare_queryable(self._key(keys.SIM_TRUTH), self._answer_truth)

    def await_labels(self, timeout_s: float = LABELS_WAIT_S) -> None:
        """Request the labels to distinguish from the navigator until it replies.

        Raises:
            SimulatedRobotError: No reply within the time.
        """
        started, is_told = time.monotonic(), False
        while time.monotonic() < started + timeout_s:
            if self._latched.request(self._last_labels):
                return
            if not is_told and time.monotonic() > started + SILENT_WAIT_S:
                is_told = True
                logger.info(
                    "waiting for the navigator of %s at %s: at its first start it compiles",
                    self._config.robot,
                    self._config.connect,
                )
            time.sleep(0.1)
        raise SimulatedRobotError(
            f"no navigator publishes labels at {self._key(keys.LABELS)}; is one running at "
            f"{self._config.connect} under the prefix {self._config.robot}?"
        )

    def _last_labels(self) -> bytes | None:
        return last_message(self._session, self._key(keys.LABELS), 1.0)

    def run_real_time(self, stop: StopSignal) -> None:
        """Step the physics in real time and publish frames at the camera's rate until stopped."""
        factor = float(self._config.speed)
        dt = 1.0 / PHYSICS_HZ
        tf_every = max(1, round(PHYSICS_HZ / TF_HZ))
        due = time.monotonic()
        tick = 0
        while not stop.is_set():
            if is_due(tick, self._config.rate_hz):
                self.publish(self._observe())
            elif tick % tf_every == 0:
                self._publish_transforms()
            self.world.step(self._fresh_command(), dt)
            self._drive.note(self.world.base, self.world.stamp_ns)
            self._report_goals()
            tick += 1
            due += dt / factor
            late = time.monotonic() - due
            if late > 1.0:
                # A machine that cannot keep up runs slower than real time instead of skipping.
                due = time.monotonic()
            elif late < 0.0:
                stop.wait(-late)

    def run_lock_step(self, stop: StopSignal) -> None:
        """Publish a frame, wait for the command that answers it, step; as fast as answers come.

        Raises:
            SimulatedRobotError: The navigator stopped answering.
        """
        dt = 1.0 / self._config.rate_hz
        while not stop.is_set():
            frame = self._observe()
            self.publish(frame)
            twist = self._await_answer(frame.stamp_ns, stop)
            if twist is None:
                return
            self.world.step(self._command(twist), dt)

    def publish(self, frame: Frame) -> None:
        """Send one frame, its heatmap first and its colour image last."""
        stamp = frame.stamp_ns
        self._publish_transforms()
        if frame.heatmap is not None:
            self._put(keys.HEATMAP, encode_heatmap(frame.heatmap, stamp, CAMERA_FRAME))
        self._put(keys.CAMERA_INFO, encode_camera(frame.camera, stamp, CAMERA_FRAME))
        self._put(keys.CONTACT, encode_flag(frame.contact))
        self._put(keys.DEPTH, encode_depth(frame.depth, stamp, CAMERA_FRAME))
        self._put(keys.COLOR, encode_color(frame.color, stamp, CAMERA_FRAME))

    def _observe(self) -> Frame:
        with self._lock:
            request = self._labels
        if request is not None:
            self.world.set_labels(request.labels, request.ooi, request.also)
        return self.world.observe()

    def _await_answer(self, stamp_ns: int, stop: StopSignal) -> StampedTwist | None:
        deadline = time.monotonic() + ANSWER_WAIT_S
        while not stop.is_set():
            try:
                twist = self._answers.get(timeout=0.2)
            except queue.Empty:
                if time.monotonic() > deadline:
                    raise SimulatedRobotError(
                        f"no command answered the frame of {stamp_ns / NANOSECONDS:.1f} s within "
                        f"{ANSWER_WAIT_S:g} s: the navigator is gone"
                    ) from None
                continue
            if twist.stamp_ns == stamp_ns:
                return twist
        return None

    def _fresh_command(self) -> Command | None:
        """Return the command since the last step; None lets the base's watchdog count."""
        twist = self._drive.fresh(self.world.stamp_ns)
        with self._lock:
            tilt = self._tilt_rad
        if twist is None and self.world.navigation is not None:
            return Command(tilt_rad=tilt, goal=self._goals.in_force(time.monotonic()))
        return None if twist is None else self._command(twist)

    def _report_goals(self) -> None:
        if self.world.navigation is not None:
            for number, outcome in self.world.navigation.take_reports():
                self._put(keys.NAVIGATION_STATUS, encode_goal_status(number, outcome))

    def _command(self, twist: StampedTwist) -> Command:
        with self._lock:
            tilt = self._tilt_rad
        return Command(
            linear_m_s=twist.linear_m_s, yaw_rate_rad_s=twist.yaw_rate_rad_s, tilt_rad=tilt
        )

    def _publish_transforms(self) -> None:
        world = self.world
        T_base_camera = world.robot.T_base_camera(world.base.tilt_rad)
        transforms = robot_transforms(world.stamp_ns, world.T_world_base_estimated, T_base_camera)
        self._put(keys.TF, encode_transforms(transforms))

    def _on_twist(self, payload: bytes) -> None:
        twist = decode_twist(payload)
        self._drive.take(twist)
        if self._config.speed == "max":
            self._answers.put(twist)

    def _on_tilt(self, payload: bytes) -> None:
        tilt = decode_number(payload)
        with self._lock:
            self._tilt_rad = tilt

    def _take_labels(self, payload: bytes) -> None:
        request = decode_json(payload, SegmentationLabels)
        with self._lock:
            self._labels = request

    def _answer_truth(self, query: zenoh.Query) -> None:
        with query:
            truth = GroundTruth(
                trajectory=[tuple(p) for p in self.world.trajectory.tolist()],
                collisions=self.world.collisions,
                frames=self.world.frames,
                stamp_ns=self.world.stamp_ns,
                speeds=self._drive.speeds(),
            )
            query.reply(self._key(keys.SIM_TRUTH), msgspec.json.encode(truth))

    def _subscribe(self, topic: str, take: Callable[[bytes], None]) -> None:
        subscribe(self._session, self._key(topic), _skipping_malformed(topic, take))

    def _put(self, topic: str, payload: bytes) -> None:
        publisher = self._publishers.get(topic)
        if publisher is None:
            # In lock-step a lost frame would never be answered.
            control = (
                zenoh.CongestionControl.BLOCK
                if self._config.speed == "max"
                else zenoh.CongestionControl.DROP
            )
            publisher = self._session.declare_publisher(
                self._key(topic), congestion_control=control
            )
            self._publishers[topic] = publisher
        publisher.put(payload)

    def _key(self, topic: str) -> str:
        return f"{self._config.robot}/{topic}"


def is_due(tick: int, rate_hz: float) -> bool:
    """Return whether a frame belongs to a step of the physics, so that their mean rate is exact."""
    return tick == 0 or tick * rate_hz // PHYSICS_HZ > (tick - 1) * rate_hz // PHYSICS_HZ


def _skipping_malformed(topic: str, take: Callable[[bytes], None]) -> Callable[[bytes], None]:
    def receive(payload: bytes) -> None:
        try:
            take(payload)
        except (MessageError, msgspec.DecodeError) as error:
            logger.warning("%s: message skipped: %s", topic, error)

    return receive


def run_robot_sim(config: RobotSimConfig, scene: Scene, start: StartPose) -> None:
    """Drive a simulated robot until SIGINT or SIGTERM.

    Raises:
        LinkError: No navigator answers.
        SimulatedRobotError: It stopped answering.
        KeyboardInterrupt: It was stopped before its first frame.
    """
    stop = ProcessStopSignal()
    with contextlib.ExitStack() as opened:
        with stop.interrupting():
            session = opened.enter_context(open_client(config.connect))
            robot = RobotSim(config, session, scene, start)
            robot.await_labels()
        logger.info("simulated robot in %s, %d objects", scene.name, len(scene.instances))
        if config.speed == "max":
            robot.run_lock_step(stop)
        else:
            robot.run_real_time(stop)
