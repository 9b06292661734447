"""Line segments in the scene that keep their node while they change."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def draw_segments(
    scene: Any, handle: Any, name: str, segments: NDArray[np.float32], colors: Any,
    thickness_m: float,
) -> Any:  # fmt: skip
    """Draw (N, 2, 3) segments in place of those of a handle, None for none; return the handle.

    `colors` is linear, and of a shape that can be broadcast to that of the segments.
    """
    if not len(segments):
        if handle is not None:
            handle.visible = False
        return handle
    shaped = np.array(np.broadcast_to(np.asarray(colors, dtype=np.uint8), segments.shape))
    if handle is None:
        return scene.add_line_segments(name, segments, shaped, thickness=thickness_m)
    handle.points, handle.colors, handle.visible = segments, shaped, True
    return handle
