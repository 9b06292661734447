"""Limits of a recording: size of the file and free space of the disk."""

from dataclasses import dataclass
from typing import Final

GB: Final = 1e9
WARN_SHARE: Final = 0.9


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingLimits:
    """Largest file and smallest free space."""

    max_gb: float = 8.0
    """Size at which a recording ends."""
    min_free_gb: float = 2.0
    """Free space on the disk below which a recording ends."""

    def __post_init__(self) -> None:
        """Refuse limits under which nothing could be recorded."""
        if not self.max_gb > 0.0:
            raise ValueError(f"the size limit of a recording must be positive; got {self.max_gb:g}")
        if not self.min_free_gb >= 0.0:
            raise ValueError(f"the free disk space must not be negative; got {self.min_free_gb:g}")


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitCheck:
    """Result of a check of the limits."""

    stop: bool
    text: str
    """Text for the operator; empty within the limits."""


def check_limits(limits: RecordingLimits, written_bytes: int, free_bytes: int) -> LimitCheck:
    """Compare written and free bytes with the limits."""
    written_gb, free_gb = written_bytes / GB, free_bytes / GB
    if written_gb >= limits.max_gb:
        text = f"the recording has reached its limit of {limits.max_gb:g} GB; the robot continues"
        return LimitCheck(stop=True, text=text)
    if free_gb <= limits.min_free_gb:
        text = (
            f"{free_gb:.1f} GB are free on the disk and {limits.min_free_gb:g} GB must stay "
            f"free; the robot continues"
        )
        return LimitCheck(stop=True, text=text)
    if written_gb >= WARN_SHARE * limits.max_gb:
        text = f"{written_gb:.1f} of {limits.max_gb:g} GB are written: recording ends soon"
        return LimitCheck(stop=False, text=text)
    if WARN_SHARE * free_gb <= limits.min_free_gb:
        text = f"{free_gb:.1f} GB are free on the disk: recording ends at {limits.min_free_gb:g} GB"
        return LimitCheck(stop=False, text=text)
    return LimitCheck(stop=False, text="")
