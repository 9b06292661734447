"""Converts streams that a robot publishes in place of the usual ones: raw images, odometry.

Raw colour images become JPEG and odometry becomes tf. The result goes to the navigator's own intake
and to the network, so that console, recorder and segmentation receive the usual topics.
"""

import contextlib
import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Final

import zenoh

from app.links.network.subscription import subscribe
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.images import decode_color_raw, encode_color
from app.messages.motion import (
    decode_odometry,
    decode_transforms,
    encode_transforms,
    robot_transforms,
)
from app.nodes.navigator.frame_intake import FrameIntake
from app.nodes.navigator.localization.odometry_frame import OdometryFrame
from ippon.robot import RobotProfile

logger = logging.getLogger(__name__)

SILENT_S: Final = 3.0
"""Silence of compressed images from which uncompressed ones are asked for."""
_RAW: Final = {"colour": keys.COLOR_RAW, "depth": keys.DEPTH_RAW}
"""Uncompressed images of each stream."""
_STREAM_OF: Final = {keys.ODOM: "pose", keys.COLOR_RAW: "colour"}
NO_MOUNT: Final = (
    "odometry without tf does not tell the tilt of a camera that tilts: publish tf, or give the "
    "profile a fixed `tilt`"
)


class StreamConverter:
    """Converts raw images and odometry in its own thread.

    Args:
        session: An open session.
        robot: Key prefix.
        profile: Its camera mount is taken where there is no tf.
        intake: Receives the converted messages.
    """

    def __init__(
        self,
        session: zenoh.Session,
        robot: str,
        profile: RobotProfile,
        intake: FrameIntake,
    ) -> None:
        self._session, self._robot = session, robot
        self._profile, self._intake = profile, intake
        self._changed = threading.Condition()
        self._poses: deque[bytes] = deque(maxlen=100)
        self._fixed: deque[bytes] = deque(maxlen=100)
        self._odometry = OdometryFrame()
        self._image: bytes | None = None
        self._started = time.monotonic()
        self._closed = False
        self._asked: dict[str, tuple[float, Callable[[], None]]] = {}
        """Streams whose uncompressed images are asked for: since when, and what ends that."""
        self._problems: dict[str, str] = {}
        self._put = {
            topic: session.declare_publisher(
                f"{robot}/{topic}",
                congestion_control=zenoh.CongestionControl.DROP,
                allowed_destination=zenoh.Locality.REMOTE,
            ).put
            for topic in (keys.COLOR, keys.TF)
        }
        # Fixed transforms first: they say which frame the odometry is of.
        fixed = partial(self._take, keys.TF_STATIC)
        subscribe(session, f"{robot}/{keys.TF_STATIC}", fixed, kept=True)
        subscribe(session, f"{robot}/{keys.ODOM}", partial(self._take, keys.ODOM))
        # At once: the first images of a recording with raw depth would be missed.
        self._ask("depth")
        threading.Thread(target=self._run, name="stream conversion", daemon=True).start()

    def check(self) -> None:
        """Take uncompressed images while no compressed ones come; report what went wrong.

        The mission's thread calls it.
        """
        for stream in _RAW:
            self._check_raw(stream)
        for topic in tuple(self._problems):
            self._intake.refuse(_STREAM_OF[topic], f"{topic}: {self._problems.pop(topic)}")

    def _check_raw(self, stream: str) -> None:
        age_s = self._intake.monitors[stream].age_s()
        silent_s = time.monotonic() - self._started if age_s is None else age_s
        asked_at, end = self._asked.get(stream, (0.0, None))
        # Not before, nor for longer: a bridge carries whatever somebody subscribes to.
        if silent_s > SILENT_S and end is None:
            self._ask(stream)
        elif end is not None and self._intake.compressed_at[stream] > asked_at:
            end()
            del self._asked[stream]

    def _ask(self, stream: str) -> None:
        topic, now = _RAW[stream], time.monotonic()
        take = partial(self._intake.inject if stream == "depth" else self._take, topic)
        self._asked[stream] = now, subscribe(self._session, f"{self._robot}/{topic}", take)

    def close(self) -> None:
        """End the thread."""
        with self._changed:
            self._closed = True
            self._changed.notify()

    def _take(self, topic: str, payload: bytes) -> None:
        with self._changed:
            if topic == keys.ODOM:
                self._poses.append(payload)
            elif topic == keys.TF_STATIC:
                self._fixed.append(payload)
            else:
                self._image = payload
            self._changed.notify()

    def _run(self) -> None:
        while True:
            with self._changed:
                while not (self._fixed or self._poses or self._image is not None or self._closed):
                    self._changed.wait()
                if self._closed:
                    return
                fixed, poses, image = tuple(self._fixed), tuple(self._poses), self._image
                self._fixed.clear()
                self._poses.clear()
                self._image = None
            for payload in fixed:
                # The intake reports those that cannot be decoded.
                with contextlib.suppress(MessageError):
                    self._odometry.add_fixed(decode_transforms(payload))
            for pose in poses:
                self._try(keys.ODOM, partial(self._convert_pose, pose))
            if image is not None:
                self._try(keys.COLOR_RAW, partial(self._convert_image, image))

    def _try(self, topic: str, convert: Callable[[], None]) -> None:
        try:
            convert()
        except (MessageError, ValueError) as error:
            self._problems[topic] = str(error)
        except zenoh.ZError as error:
            logger.debug("%s was not sent on: %s", topic, error)

    def _convert_image(self, payload: bytes) -> None:
        color, stamp_ns, frame_id = decode_color_raw(payload)
        self._send(keys.COLOR, encode_color(color, stamp_ns, frame_id))

    def _convert_pose(self, payload: bytes) -> None:
        camera_frame = self._intake.assembler.camera_frame
        if self._intake.has_tf or camera_frame is None:
            return
        if self._profile.can_tilt:
            raise MessageError(NO_MOUNT)
        pose = decode_odometry(payload)
        T_child_base = self._odometry.base_in(pose.child, camera_frame)
        T_base_camera = self._profile.T_base_camera(self._profile.min_tilt_rad)
        transforms = robot_transforms(
            pose.stamp_ns, pose.T_parent_child @ T_child_base, T_base_camera, camera_frame
        )
        self._send(keys.TF, encode_transforms(transforms))

    def _send(self, topic: str, payload: bytes) -> None:
        self._intake.inject(topic, payload)
        self._put[topic](payload, attachment=keys.COMPUTED if topic == keys.TF else None)
