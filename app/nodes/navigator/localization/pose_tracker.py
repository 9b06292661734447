"""Gives a camera that knows no pose one, from its images, as tf."""

import logging
import math
import threading
from collections import deque
from functools import partial
from typing import Any, Final

import numpy as np
import zenoh
from numpy.typing import NDArray

from app.datasets.floor_alignment import base_below, camera_on_base
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.depth.depth_images import DEPTH_DECODERS, DepthImage
from app.messages.images import (
    PAIRED_S,
    CompressedColor,
    decode_camera,
    decode_color,
    decompress_color,
)
from app.messages.motion import StampedTransform, encode_transforms, robot_transforms
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.event_publisher import EventPublisher
from app.nodes.navigator.frame_intake import FrameIntake
from ippon.frame import NANOSECONDS
from ippon.geometry import Float64Array, base_pose
from ippon.robot import RobotProfile
from ippon.tracking.camera_tracker import TrackerConfig
from ippon.tracking.hand_held import HandHeldCamera
from ippon.tracking.start_pose import AssumedMount

logger = logging.getLogger(__name__)

_APART_NS: Final = round(PAIRED_S * NANOSECONDS)
_WAITING: Final = 4
HELD_RAD: Final = math.radians(-25.0)
"""Tilt at which a camera that can be tilted is held at first, roughly."""
LOST_TEXT: Final = (
    "the camera has lost its place: point it at something that it has seen before, and hold it "
    "still for a moment"
)


class PoseTracker:
    """Tracks in its own thread; idle while the robot publishes tf itself.

    Args:
        session: An open session.
        robot: Key prefix.
        profile: How the camera is held.
        intake: Gets the poses.
        events: Hears that the camera is lost, and found again.
        camera_clock_offset_s: How far the camera's clock is behind that of the poses, by which the
            intake looks them up.
    """

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        profile: RobotProfile,
        intake: FrameIntake,
        events: EventPublisher,
        camera_clock_offset_s: float = 0.0,
    ) -> None:
        self._offset_ns = round(NANOSECONDS * camera_clock_offset_s)
        self._profile, self._intake, self._events = profile, intake, events
        self._put = session.declare_publisher(
            f"{robot}/{keys.TF}",
            congestion_control=zenoh.CongestionControl.DROP,
            allowed_destination=zenoh.Locality.REMOTE,
        ).put
        self._changed = threading.Condition()
        self._colors: deque[CompressedColor] = deque(maxlen=_WAITING)
        self._depths: deque[DepthImage] = deque(maxlen=_WAITING)
        self._arrived: deque[tuple[str, bytes]] = deque(maxlen=4 * _WAITING)
        self._frame_id = ""
        self._camera: Any = None
        self._held: HandHeldCamera | None = None
        self._size = (0, 0)
        self._done_ns = -1
        self._closed = False
        self._had_pose = self._was_lost = False
        self.problem = ""
        """Why the last frame has no pose, for the operator; empty if it has one."""
        for topic in (keys.CAMERA_INFO, keys.COLOR, *DEPTH_DECODERS):
            intake.listen(topic, partial(self._take, topic))
        self._thread = threading.Thread(target=self._run, name="pose tracking", daemon=True)
        self._thread.start()

    def check(self) -> None:
        """Report that the camera was lost or found; the mission's thread calls it."""
        lost = bool(self.problem) and self._had_pose
        if lost and not self._was_lost:
            self._events.report("stream_lost", self.problem)
        elif self._was_lost and not lost:
            self._events.report("stream_back", "the camera knows its place again")
        self._was_lost = lost

    def close(self) -> None:
        """End the thread."""
        with self._changed:
            self._closed = True
            self._changed.notify()

    def _take(self, topic: str, payload: bytes) -> None:
        with self._changed:
            self._arrived.append((topic, payload))
            self._changed.notify()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closed or self._arrived)
                if self._closed:
                    return
                arrived = list(self._arrived)
                self._arrived.clear()
            for topic, payload in arrived:
                try:
                    self._decode(topic, payload)
                except (MessageError, ValueError) as error:
                    # The intake, which gets the same message, counts and reports it.
                    logger.debug("%s is skipped: %s", topic, error)
            if self._intake.has_tf:
                self.problem = ""
                continue
            pair = self._newest_pair()
            if pair is not None:
                self._track(*pair)

    def _decode(self, topic: str, payload: bytes) -> None:
        if topic == keys.CAMERA_INFO:
            stamped = decode_camera(payload)
            self._frame_id, self._camera = stamped.frame_id, stamped.camera
        elif topic == keys.COLOR:
            self._colors.append(decode_color(payload))
        else:
            self._depths.append(DEPTH_DECODERS[topic](payload))

    def _newest_pair(self) -> tuple[CompressedColor, DepthImage] | None:
        """Return the newest colour image that has a depth image, once."""
        for color in sorted(self._colors, key=lambda one: -one.stamp_ns):
            if color.stamp_ns == self._done_ns:
                return None
            for depth in self._depths:
                if abs(depth.stamp_ns - color.stamp_ns) <= _APART_NS:
                    return color, depth
        return None

    def _track(self, color: CompressedColor, depth: DepthImage) -> None:
        if self._camera is None:
            return
        self._done_ns = color.stamp_ns
        try:
            image = decompress_color(color.encoded)
        except (MessageError, ValueError) as error:
            logger.debug("an image is skipped: %s", error)
            return
        size = (self._camera.height, self._camera.width)
        if image.shape[:2] != size or depth.depth.shape != size:
            self.problem = (
                f"colour is {image.shape[1]}x{image.shape[0]}, depth "
                f"{depth.depth.shape[1]}x{depth.depth.shape[0]} and camera info "
                f"{size[1]}x{size[0]}: one size is needed to find the camera's place"
            )
            return
        self._publish(image, depth.depth, color.stamp_ns)

    def _publish(self, image: NDArray[np.uint8], depth: NDArray[np.float32], stamp_ns: int) -> None:
        tracked = self._hand_held().track(image, depth)
        if tracked.T_world_camera is None:
            self.problem = LOST_TEXT if self._had_pose else tracked.problem
            logger.debug("no pose: %s", tracked.problem)
            return
        self.problem, self._had_pose = "", True
        poses = transforms_of(
            tracked.T_world_camera,
            self._profile.camera_forward_m,
            stamp_ns + self._offset_ns,
            self._frame_id,
        )
        payload = encode_transforms(poses)
        self._intake.inject(keys.TF, payload)
        self._intake.wake()
        try:
            self._put(payload, attachment=keys.COMPUTED)
        except zenoh.ZError as error:
            logger.debug("a pose was not sent on: %s", error)

    def _hand_held(self) -> HandHeldCamera:
        size = (self._camera.width, self._camera.height)
        if self._held is None or size != self._size:
            profile, self._size = self._profile, size
            tilt = profile.within_tilt(HELD_RAD)
            mount = AssumedMount(height_m=profile.camera_height_m, tilt_rad=tilt)
            config = TrackerConfig(nearest_m=profile.min_depth_m, farthest_m=profile.max_depth_m)
            self._held = HandHeldCamera(self._camera, mount, config)
        return self._held


def pose_tracker(
    session: zenoh.Session, config: NavigatorConfig, intake: FrameIntake, events: EventPublisher
) -> PoseTracker | None:
    """Return a tracker where the profile asks for one; None where the robot sends its pose."""
    if not config.profile.tracks_pose:
        return None
    offset_s = config.camera_clock_offset_s
    return PoseTracker(session, config.robot, config.profile, intake, events, offset_s)


def transforms_of(
    T_map_camera: Float64Array, forward_m: float, stamp_ns: int, camera_frame: str
) -> tuple[StampedTransform, ...]:
    """Return tf of a camera in a hand: the base stands behind it on the floor.

    Args:
        T_map_camera: Pose of the camera.
        forward_m: Distance of the camera in front of the base.
        stamp_ns: Stamp of the image, by the clock of the poses.
        camera_frame: Its coordinate frame.
    """
    T_map_base = base_below(T_map_camera) @ base_pose(-forward_m, 0.0, 0.0, 0.0)
    T_base_camera = camera_on_base(T_map_base, T_map_camera)
    return robot_transforms(stamp_ns, T_map_base, T_base_camera, camera_frame)
