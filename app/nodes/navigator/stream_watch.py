"""Detects streams of the robot that fall silent, and reports when they return."""

import time
from collections.abc import Callable, Sequence
from typing import Final

from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.frame_intake import FrameIntake

NO_HEATMAP: Final = "objects are not recognised; the search continues"


class StreamWatch:
    """Compares the age of each stream with its limit; the mission's thread calls it."""

    def __init__(
        self,
        config: NavigatorConfig,
        intake: FrameIntake,
        report_event: Callable[[str, str], None],
        drop_command: Callable[[], None],
    ) -> None:
        """Watch the streams of an intake.

        Args:
            config: Holds the limits.
            intake: Counts the messages.
            report_event: Publishes an event of a kind with a text.
            drop_command: Called when a required stream is lost: the last command is void.
        """
        self.lost: Sequence[tuple[str, float | None]] = ()
        """Required streams that are silent now, or what frames lack, each with its age."""
        self._config = config
        self._intake = intake
        self._report_event = report_event
        self._drop_command = drop_command
        self._heatmap_lost = False
        self._frames_lost_at = 0.0

    def check_required(self) -> None:
        """Update `lost`, and report streams that were lost or came back."""
        if self._intake.frames == 0:
            return
        limit_s = self._config.lost_s
        lost = self._intake.lost(limit_s)
        names = ", ".join(name for name, _ in lost or self.lost)
        if lost and not self.lost:
            self._drop_command()
            silent = f"no {names} for {limit_s:g} s: waiting"
            self._report_event("stream_lost", self._intake.ended or silent)
        elif self.lost and not lost:
            self._report_event("stream_back", f"{names} is back")
        self.lost = lost

    def check_heatmap(self, *, searching: bool) -> None:
        """Report a segmentation that falls silent during a search, and its return."""
        now = time.monotonic()
        age_s = self._intake.monitors["heatmap"].age_s()
        image_age_s = self._intake.monitors["colour"].age_s()
        if self.lost or self._intake.frames == 0:
            self._frames_lost_at = now
        if image_age_s is None or self.lost or self._intake.frames == 0:
            return
        # Time without images does not count: the robot is silent then, not the segmentation.
        silent_s = now - self._frames_lost_at
        if age_s is not None:
            silent_s = min(age_s - image_age_s, silent_s)
        lost = silent_s > self._config.heatmap_lost_s
        if lost and not self._heatmap_lost and searching:
            self._heatmap_lost = True
            silent = "no heatmap has come" if age_s is None else f"no heatmap for {age_s:.0f} s"
            self._report_event("stream_lost", f"{silent}: {NO_HEATMAP}")
        elif self._heatmap_lost and not lost:
            self._heatmap_lost = False
            self._report_event("stream_back", "heatmap is back")

    def notes(self) -> tuple[str, ...]:
        """Return the lines of the status that concern the streams."""
        return (f"no heatmap: {NO_HEATMAP}",) if self._heatmap_lost else ()
