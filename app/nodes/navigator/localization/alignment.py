"""Finds the robot's place in a kept map before anything else: it turns once where it stands.

Only then does the navigator take requests; a Stop is obeyed here, too.
"""

import dataclasses
import logging
import math
import time
from importlib.metadata import version
from typing import Final

import numpy as np
import zenoh

from app.links.network.latched_topic import LatchedTopic
from app.links.network.requests import RequestRefusedError, serve
from app.links.network.sender import Sender
from app.links.robot_streams.robot_detector import RobotDetector
from app.messages import keys
from app.messages.control import ControlReply, ControlRequest, encode
from app.messages.status import Status, Timings
from app.nodes.navigator.command.command_stream import CommandStream
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.frame_intake import FrameIntake
from app.nodes.navigator.stream_conversion import StreamConverter
from app.process.stop_signal import StopSignal
from ippon.command import Command
from ippon.errors import FrameRejectedError
from ippon.frame import NANOSECONDS, Frame
from ippon.geometry import Float64Array, wrap_angle, yaw_of
from ippon.mapping.voxel_map import VoxelMap
from ippon.memory.registration import (
    Registration,
    RegistrationError,
    register,
    seen_points,
    surface_points,
)
from ippon.mission.safe_motion import SafeMotion, moves_base

logger = logging.getLogger(__name__)

PATIENCE_S: Final = 120.0
"""Time for the turn, without the time for which the robot is stopped."""
_WHOLE_TURN_RAD: Final = math.radians(350.0)
_SHARE_OF_SPEED: Final = 0.5
"""Of the robot's fastest turn."""
_BLOCKED_S: Final = 5.0
"""Time without a safe turn after which the robot has no space."""
_EVERY_RAD: Final = math.radians(20.0)
"""Turn from one view that is used to the next."""
_REACH_M: Final = 6.0
_IDLE_S: Final = 0.05
_STATUS_EVERY_S: Final = 0.4


class NoFrameError(Exception):
    """Nothing was seen that a place could be found by."""


class Alignment:
    """Turns the robot once and registers what it sees on a map.

    Args:
        session: A router that the robot is connected to; close it when the place is found.
        config: Of the navigator.
        voxel_map: The kept map.
        held: A Stop is in force: the turn begins after Resume.
    """

    def __init__(
        self,
        session: zenoh.Session,
        config: NavigatorConfig,
        voxel_map: VoxelMap,
        *,
        held: bool = False,
    ) -> None:
        self._config, self._map = config, voxel_map
        robot = config.robot
        self._intake = FrameIntake(
            session, robot, logger.warning, RobotDetector(config.detector),
            config.camera_clock_offset_s,
        )  # fmt: skip
        self._converter = StreamConverter(session, robot, config.profile, self._intake)
        self._stream = CommandStream(
            session, robot, config.command_hz, config.stale_s,
            velocities=config.profile.takes_velocities,
        )  # fmt: skip
        self.is_stopped = held
        """The operator has stopped the robot."""
        if held:
            self._stream.halt()
        self._sender, self._status_at = Sender(), 0.0
        self._status = LatchedTopic(session, f"{robot}/{keys.STATUS}", self._sender)
        self._control = serve(
            session, f"{robot}/{keys.CONTROL}", ControlRequest, self._obey,
            on_stop=self._stream.hold,
        )  # fmt: skip
        # A map of its own: the kept one is in another frame.
        self._seen = VoxelMap(config.mission.map, config.labels)
        self._motion = SafeMotion(config.profile, self._seen)
        self._views: list[Float64Array] = []
        self._last: Frame | None = None
        self._turned_rad = self._since_view_rad = 0.0
        self._blocked_s = 0.0

    def run(self, stop: StopSignal, *, patience_s: float = PATIENCE_S) -> Registration | None:
        """Turn and register; None when the process is to end.

        Raises:
            RegistrationError: The robot has no certain place in the map.
            NoFrameError: Not one usable image came with its pose.
        """
        spent_s, before = 0.0, time.monotonic()
        try:
            while self._turned_rad < _WHOLE_TURN_RAD:
                if stop.is_set():
                    return None
                self._converter.check()
                self._publish_status()
                frame = self._intake.take(_IDLE_S)
                if frame is not None:
                    self._step(frame)
                now = time.monotonic()
                spent_s += 0.0 if self.is_stopped else now - before
                before = now
                self._check_progress(spent_s, patience_s)
        finally:
            self._stream.close()
            self._converter.close()
            self._sender.close()
        assert self._last is not None, "it has turned"
        floor_z_m = float(self._last.T_world_base[2, 3])
        surface = surface_points(self._map)
        points = np.concatenate(self._views)
        return register(points, floor_z_m, surface, self._map.floor_z_m)

    def _check_progress(self, spent_s: float, patience_s: float) -> None:
        turned = max(0.0, math.degrees(self._turned_rad))
        if self._blocked_s > _BLOCKED_S:
            raise RegistrationError(
                f"the robot has no space to turn: it turned by {turned:.0f} degrees; move it to "
                "where it can turn"
            )
        if spent_s > patience_s:
            if self._last is None:
                raise NoFrameError(
                    f"{self._config.keep_map} stays as it is: no image came with its pose within "
                    f"{patience_s:.0f} s{self._lacks()}. With a navigator without --map and "
                    f"--align, `ippon doctor --robot {self._config.robot}` says what the robot "
                    "sends"
                )
            text = f"the robot has turned by {turned:.0f} degrees within {patience_s:.0f} s"
            if self._last.contact:
                text = f"the bumper is pressed; {text}"
            raise RegistrationError(text)

    def _lacks(self) -> str:
        """Return which streams never came or what else an image lacks, and what was refused."""
        intake = self._intake
        silent = ", ".join(name for name, _ in intake.lost(math.inf))
        missing = silent or intake.assembler.missing()
        problems = [intake.refused, *(one.last_problem for one in intake.monitors.values())]
        told = [f"what is missing: {missing}"] if missing else []
        told += [text for text in dict.fromkeys(problems) if text]
        return "".join(f"; {text}" for text in told)

    def _step(self, frame: Frame) -> None:
        try:
            self._seen.integrate(frame)
        except FrameRejectedError as error:
            self._intake.refuse_frame(str(error), frame.stamp_ns)
            self._stream.give(Command(tilt_rad=frame.tilt_rad), frame.stamp_ns)
            return
        self._intake.accept()
        dt_s = 0.0 if self._last is None else (frame.stamp_ns - self._last.stamp_ns) / NANOSECONDS
        self._note_turn(frame)
        command = self._command(frame, dt_s)
        is_free = moves_base(command) or self.is_stopped or frame.contact
        self._blocked_s = 0.0 if is_free else self._blocked_s + dt_s
        self._stream.give(command, frame.stamp_ns)
        self._last = frame

    def _command(self, frame: Frame, dt_s: float) -> Command:
        """Return the next command of the turn; it stands while stopped, and where it touches."""
        if self.is_stopped or frame.contact:
            self._motion.resume_from(Command())
            return Command(tilt_rad=frame.tilt_rad)
        profile = self._config.profile
        wanted = Command(
            yaw_rate_rad_s=_SHARE_OF_SPEED * profile.max_yaw_rate_rad_s,
            tilt_rad=min(max(0.0, profile.min_tilt_rad), profile.max_tilt_rad),
        )
        eased = self._motion.accelerate(wanted, max(dt_s, 1e-3), brakes_at_once=False)
        age_s = time.perf_counter() - self._intake.arrived_at
        return self._motion.avoid_collision(eased, frame, dt_s, age_s)[0]

    def _note_turn(self, frame: Frame) -> None:
        """Add the turn since the last frame, and the points in view at intervals of it."""
        if self._last is not None:
            before = yaw_of(self._last.T_world_base)
            # With its sign: the noise of the pose adds up to nothing.
            turn = wrap_angle(yaw_of(frame.T_world_base) - before)
            self._turned_rad += turn
            self._since_view_rad += turn
        if self._last is None or self._since_view_rad >= _EVERY_RAD:
            self._since_view_rad = 0.0
            self._views.append(seen_points(frame, _REACH_M))

    def _publish_status(self) -> None:
        """Tell pages and programs at intervals what the robot does, and whether it is stopped."""
        if time.monotonic() - self._status_at < _STATUS_EVERY_S:
            return
        self._status_at = time.monotonic()
        self._status.put(encode(status_of(self._config, is_stopped=self.is_stopped)))

    def _obey(self, request: ControlRequest) -> ControlReply:
        """Stop and resume the turn; called in the thread of the key."""
        if request.action == "cancel":
            raise RequestRefusedError("the robot is finding its place in the map; stop it instead")
        if request.action == "resume":
            self.is_stopped = not self._stream.release(if_count=self._stream.halts)
        else:
            self._stream.halt()
            self.is_stopped = True
        return ControlReply(state="stopped" if self.is_stopped else "starting")


def status_of(config: NavigatorConfig, *, is_stopped: bool) -> Status:
    """Return the status of a navigator that aligns the robot: it has neither goals nor a map."""
    why = "the robot turns once where it stands, to find its place in the map"
    return Status(
        robot=config.robot,
        version=version("ippon"),
        stamp_ns=0,
        wall_ns=time.time_ns(),
        state="stopped" if is_stopped else "starting",
        why="stopped: press Resume to continue" if is_stopped else why,
        goal=None,
        queue=[],
        history=[],
        find=None,
        streams=[],
        timings=Timings(),
        frames=0,
        elapsed_s=0.0,
        path_length_m=0.0,
        best_ooi=0.0,
        explored_m2=0.0,
        surface_voxels=0,
        voxel_size_m=config.mission.map.voxel_size_m,
        map_revision=0,
    )


def in_map_frame(frame: Frame, T_map_world: Float64Array | None) -> Frame:
    """Return a frame with its poses in the map's frame.

    The map stays as it is: to turn it would be to sample its voxels anew.
    """
    if T_map_world is None:
        return frame
    return dataclasses.replace(
        frame,
        T_world_camera=T_map_world @ frame.T_world_camera,
        T_world_base=T_map_world @ frame.T_world_base,
    )


def said_registration(registration: Registration) -> str:
    """Return where the robot's frame lies in the map, and how well that fits."""
    T = registration.T_map_world
    x, y, z = T[:3, 3].tolist()
    return (
        f"aligned to the kept map: turned by {math.degrees(yaw_of(T)):.1f} degrees, moved by "
        f"({x:.2f}, {y:.2f}, {z:.2f}) m; {registration.fitness:.0%} of what is seen fits, with an "
        f"error of {registration.rmse_m:.2f} m"
    )
