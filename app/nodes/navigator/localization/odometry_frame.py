"""Where the base is in the frame whose pose a robot's odometry is."""

from collections.abc import Iterable

from app.links.robot_streams.transforms import TransformBuffer
from app.messages.cdr import MessageError
from app.messages.keys import BASE_FRAME
from app.messages.motion import StampedTransform
from app.recording.frame_tree import odometry_child
from ippon.geometry import Float64Array


class OdometryFrame:
    """The fixed transforms of a robot without tf, and what its odometry means by them."""

    def __init__(self) -> None:
        self._fixed = TransformBuffer()
        self._names: set[str] = set()

    def add_fixed(self, transforms: Iterable[StampedTransform]) -> None:
        """Take fixed transforms.

        Raises:
            MessageError: They name too many frames.
        """
        for transform in transforms:
            self._fixed.add(transform, fixed=True)
            self._names |= {transform.parent, transform.child}

    def base_in(self, child: str, camera: str | None) -> Float64Array:
        """Return T_child_base (4, 4): where the base is in the child frame of odometry.

        Args:
            child: The child frame; empty where the messages name none.
            camera: The camera's frame; None while it is unknown.

        Raises:
            MessageError: The frame is not that of the base, nor joined to it from above by fixed
                transforms, as `base_footprint` often is.
        """
        child = odometry_child(child, self._names, camera)
        T_child_base = self._fixed.lookup(child, BASE_FRAME, 0)
        if T_child_base is None:
            raise MessageError(
                f"odometry is the pose of {child!r}, and not of 'base_link': give it the child "
                "frame 'base_link', or publish tf, or a fixed transform from that frame to "
                "'base_link'"
            )
        return T_child_base
