"""Compares what the robot sees with a map that was read, until it is known to be of its frame."""

from collections.abc import Callable
from pathlib import Path
from typing import Final

from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.state.map_aside import copy_aside
from ippon.frame import Frame
from ippon.mapping.voxel_map import VoxelMap
from ippon.memory.frame_check import FrameCheck

MOST_VIEWS: Final = 100
"""Images from different places, or in different directions, after which it is given up."""
DISAGREES: Final = 0.25
"""Share of what is seen that contradicts the map."""


class MapCheck:
    """Looks at images before they are fused; the map's file stays as it was meanwhile.

    Args:
        voxel_map: None where none was read.
        report_event: Reports what the operator should know.
        config: Of the navigator.
    """

    def __init__(
        self,
        voxel_map: VoxelMap | None,
        report_event: Callable[[str, str], None],
        config: NavigatorConfig,
    ) -> None:
        self._check = None if voxel_map is None else FrameCheck(voxel_map)
        self._report_event, self._config = report_event, config
        self.problem = ""
        """What is wrong, for the operator, until Resume; the robot must not move on by itself."""
        self._noted = ""

    def waits(self) -> bool:
        """Return whether the map may be of another frame: nothing of it is to be overwritten."""
        return self._check is not None

    @property
    def note(self) -> str:
        """What an operator should know of the map; empty for nothing."""
        if self._check is not None and self._check.views:
            return (
                "the kept map is not confirmed yet: too little of it has been in view to know that "
                "the robot's frame is the same; its file stays as it is until then"
            )
        return self.problem or self._noted

    def check(self, frame: Frame, *, held: bool = True) -> bool:
        """Look at a frame; return whether the frames up to this one contradict the map.

        The map goes on in the new frame, and its file is written: a copy keeps what was there.

        Args:
            frame: Before it is fused.
            held: The robot stands until Resume; if not, a contradiction is only noted from now on.
        """
        check = self._check
        if check is None:
            if not held:
                self._noted, self.problem = self.note, ""
            return False
        check.add(frame)
        if check.is_enough:
            self._check = None
            share = check.contradiction
            if share > DISAGREES:
                self.problem = (
                    f"the map does not fit what the robot sees: {share:.0%} of it contradicts the "
                    f"map; the robot's frame has changed: {self._copied()}"
                )
                self._report_event("error", self.problem)
        elif check.views >= MOST_VIEWS:
            self._check = None
            self._noted = (
                f"the kept map was not confirmed: too little of it was in view of {MOST_VIEWS} "
                f"images; if the robot's frame has changed: {self._copied()}"
            )
            self._report_event("memory", self._noted)
        return bool(self.problem)

    def _copied(self) -> str:
        """Copy the kept map, and say how to go on."""
        try:
            name = copy_aside(Path(self._config.keep_map)).name
        except OSError as error:
            return f"the map as it was could not be kept ({error.strerror})"
        if not self._config.profile.takes_velocities:
            return f"the map as it was is kept as {name}; start again with another --map"
        return f"the map as it was is kept as {name}; start again with --align and that --map"
