"""A camera in a hand: its first pose from the floor in view, then tracked."""

import numpy as np
from numpy.typing import NDArray

from ippon.camera import PinholeCamera
from ippon.tracking.camera_tracker import CameraTracker, TrackedPose, TrackerConfig
from ippon.tracking.depth_points import points_of
from ippon.tracking.start_pose import AssumedMount, NoFloorError, start_pose


class HandHeldCamera:
    """Finds the pose of each frame in a world with z up and the floor at 0.

    Args:
        camera: Intrinsics of all frames.
        mount: How the camera is held at first, roughly.
        config: Of the tracker.
    """

    def __init__(
        self, camera: PinholeCamera, mount: AssumedMount, config: TrackerConfig | None = None
    ) -> None:
        self._camera, self._mount = camera, mount
        self._config = config or TrackerConfig()
        self._tracker: CameraTracker | None = None

    def track(self, color: NDArray[np.uint8], depth: NDArray[np.float32]) -> TrackedPose:
        """Return the pose of the next frame; none until the floor was in view once.

        Args:
            color: (H, W, 3) RGB.
            depth: (H, W) metres, registered to colour; 0 for no return.
        """
        if self._tracker is not None:
            return self._tracker.track(color, depth)
        config = self._config
        seen = points_of(depth, self._camera, config.nearest_m, config.farthest_m)
        try:
            pose = start_pose(seen.thinned(config.cell_m), self._mount)
        except NoFloorError as error:
            return TrackedPose(T_world_camera=None, fit=0.0, problem=str(error))
        tracker = CameraTracker(self._camera, pose, config)
        first = tracker.track(color, depth)
        # The pose is that of this frame: another one begins anew.
        if first.T_world_camera is not None:
            self._tracker = tracker
        return first
