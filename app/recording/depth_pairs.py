"""How many colour images of a recording have a depth image of their time."""

from bisect import bisect_left

from app.messages import keys
from app.messages.images import PAIRED_S
from app.recording.frame_tree import IMAGES, image_stamp_ns
from ippon.frame import NANOSECONDS

FEW = 0.1
"""Share of images without depth or pose that is not worth a word."""


class DepthPairs:
    """Stamps of colour and depth images."""

    def __init__(self) -> None:
        self.colors: list[int] = []
        """Stamps of the colour images, nanoseconds."""
        self._depths: list[int] = []

    def add(self, key: str, payload: bytes) -> None:
        """Take a message; those that are no image are ignored."""
        if key in IMAGES or key in (keys.DEPTH, keys.DEPTH_RAW):
            stamp_ns = image_stamp_ns(payload)
            if stamp_ns is not None:
                (self.colors if key in IMAGES else self._depths).append(stamp_ns)

    def problem(self) -> str:
        """Return how many colour images have no depth; empty where few or all of them have none."""
        depths = sorted(self._depths)
        alone = sum(not _has_near(depths, stamp) for stamp in self.colors)
        if not depths or alone <= FEW * len(self.colors):
            return ""
        return (
            f"{alone} of {len(self.colors)} colour images have no depth image within "
            f"{1000 * PAIRED_S:.0f} ms of their stamp: they are not mapped"
        )


def _has_near(stamps: list[int], stamp: int) -> bool:
    k = bisect_left(stamps, stamp)
    return any(abs(one - stamp) <= PAIRED_S * NANOSECONDS for one in stamps[max(k - 1, 0) : k + 1])
