"""The look around at the start of a search: down, a full turn, and back (Sec. Traversability)."""

import math

import numpy as np

from ippon.command import Command
from ippon.control.tilt_wait import TiltWait
from ippon.frame import NANOSECONDS, Frame
from ippon.geometry import Float64Array, wrap_angle, yaw_of
from ippon.mission.behaviors.behavior import Action, StepContext
from ippon.mission.behaviors.config import LookAroundConfig
from ippon.mission.journal import Journal
from ippon.mission.search import Search
from ippon.mission.snapshot import MissionState
from ippon.robot import RobotProfile


class LookAround:
    """Looks down, turns until the images cover a full circle, and turns back over the floor."""

    def __init__(
        self, config: LookAroundConfig, robot: RobotProfile, journal: Journal | None = None
    ) -> None:
        self._config = config
        self._journal = journal or Journal()
        self._tilt_wait = TiltWait(robot)
        self._robot = robot
        self._down_tilt = robot.within_tilt(config.down_tilt_rad)
        self._turn_tilt = robot.within_tilt(config.turn_tilt_rad)
        self._done_for: tuple[str, Float64Array] | None = None
        """Object of the last look around, and the pose of the robot then."""
        self.restart()
        self._overlap_rad = config.overlap_fraction * robot.horizontal_fov_rad
        self._circle_rad = 2.0 * math.pi - robot.horizontal_fov_rad + self._overlap_rad
        # A fixed camera would show the same images again.
        self._floor_tilt = config.floor_tilt_rad if robot.can_tilt else None
        turns = 0 if not config.turn else 1 if self._floor_tilt is None else 2
        self._all_rad = turns * self._circle_rad

    def restart(self) -> None:
        """Look around again from the beginning."""
        self._looked_down = False
        self._turned_rad = 0.0
        self._begun_rad = 0.0
        """What had been turned when the present turn began: the first one, or the one back."""
        self._acted_ns: int | None = None
        """Stamp of the last frame that this behavior acted on."""
        self._waits = 0
        self._last_yaw: float | None = None
        self._tilt_wait.restart()

    def was_done_for(self, label: str, last: Frame | None) -> bool:
        """Return whether the robot stands where it last looked around for this object.

        Args:
            label: Canonical label of the object.
            last: The last frame, None before the first.
        """
        if self._done_for is None or last is None or self._done_for[0] != label:
            return False
        moved = last.T_world_base[:3, 3] - self._done_for[1][:3, 3]
        return float(np.linalg.norm(moved)) <= self._config.same_place_m

    def act(self, step: StepContext) -> Action | None:
        """See `Behavior.act`."""
        search, frame = step.search, step.frame
        if search is None:
            return None
        if step.plan.ends_search:
            self.interrupt(search.path_length_m)
            return None
        if self.done:
            return None
        if self.waits():
            return Action(step.hold)
        if self._acted_ns != frame.stamp_ns - round(step.dt_s * NANOSECONDS):
            # Something else has commanded the robot since, or nothing: that turn was not this one.
            self._last_yaw = None
        self._acted_ns = frame.stamp_ns
        self._done_for = (search.goal.object, frame.T_world_base)
        why = f"looking around ({self.progress:.0%})"
        command = self.step(yaw_of(frame.T_world_base), frame.tilt_rad, step.dt_s)
        return Action(command, MissionState.LOOKING_AROUND, why)

    def abandon(self, search: Search | None) -> None:
        """Skip the rest if the robot is looking around now: it has no space to turn."""
        if search is not None and search.state is MissionState.LOOKING_AROUND:
            self.skip()

    @property
    def done(self) -> bool:
        """The images cover the full circle."""
        return self._looked_down and self._turned_rad >= self._all_rad

    @property
    def progress(self) -> float:
        """0 at the start, 1 when done."""
        if not self._looked_down:
            return 0.0
        return 1.0 if self.done else self._turned_rad / self._all_rad

    def skip(self) -> None:
        """Skip the rest of the look around."""
        self._looked_down = True
        self._turned_rad = self._all_rad

    def interrupt(self, gone_m: float) -> None:
        """Interrupt the look around for a terminating viewpoint.

        It continues, from the heading that the robot has then, if the object disappears nearby.

        Args:
            gone_m: Path length since the search began.
        """
        self._last_yaw = None
        self._waits = self._config.wait_steps
        if gone_m > self._config.same_place_m:
            self.skip()

    def waits(self) -> bool:
        """Return whether to hold still, in case the terminating viewpoint reappears."""
        self._waits = max(0, self._waits - 1)
        return self._waits > 0

    def step(self, yaw_rad: float, tilt_rad: float, dt_s: float) -> Command:
        """Return the next command.

        Args:
            yaw_rad: The robot's heading.
            tilt_rad: Tilt of its camera.
            dt_s: Seconds since the last step.
        """
        if not self._looked_down:
            if self._awaits(self._down_tilt, tilt_rad, dt_s):
                return Command(tilt_rad=self._down_tilt)
            self._looked_down = True
        floor_tilt = self._floor_tilt
        back = floor_tilt is not None and self._turned_rad >= self._circle_rad
        direction = -1.0 if back else 1.0
        if self._last_yaw is not None:
            # With its sign: the noise of the pose adds up to nothing.
            turned = self._turned_rad + direction * wrap_angle(yaw_rad - self._last_yaw)
            self._turned_rad = max(self._begun_rad, turned)
            if not back and self._turned_rad >= self._circle_rad:
                self._begun_rad = self._turned_rad
        self._last_yaw = yaw_rad
        if self.done:
            return Command(tilt_rad=self._turn_tilt)
        if floor_tilt is None or self._turned_rad < self._circle_rad:
            return self._turn(1.0, self._turn_tilt)
        tilt = self._robot.within_tilt(floor_tilt)
        begins = self._turned_rad < self._circle_rad + self._overlap_rad
        if begins and self._awaits(tilt, tilt_rad, dt_s):
            return Command(tilt_rad=tilt)
        return self._turn(-1.0, tilt)

    def _turn(self, direction: float, tilt_rad: float) -> Command:
        rate = direction * self._robot.max_yaw_rate_rad_s
        return Command(yaw_rate_rad_s=rate, tilt_rad=tilt_rad)

    def _awaits(self, tilt_rad: float, now_rad: float, dt_s: float) -> bool:
        """Return whether to wait for a tilt; says once that it does not come."""
        wait, gave_up = self._tilt_wait, self._tilt_wait.given_up
        is_over = wait.is_over(now_rad - tilt_rad, self._config.tilt_tolerance_rad, dt_s)
        if wait.given_up and not gave_up:
            text = "the camera does not tilt: the search goes on with the tilt that it has"
            self._journal.note("error", text)
        return not is_over
