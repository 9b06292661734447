"""The line of the doctor about the clocks of camera and poses."""

from typing import Final

from app.doctor.finding import Finding
from app.links.robot_streams.clock_offset import WIDEST_S, Depths, PoseAt, estimate_offset
from ippon.camera import PinholeCamera

TOLERATED_S: Final = 0.02


def check_offset(
    depths: Depths, camera: PinholeCamera, pose_at: PoseAt, known_s: float = 0.0
) -> Finding:
    """Return the line about the offset, with the entry of the profile that corrects it.

    Args:
        depths: Stamps and depth images.
        camera: Intrinsics.
        pose_at: Poses of the camera, with the offset of the profile applied.
        known_s: That offset.
    """
    estimate = estimate_offset(depths, camera, pose_at)
    what = "camera and pose clock"
    if estimate is None:
        return Finding(
            what=what, verdict="ok",
            detail="not compared: that takes a robot that turns to and fro meanwhile, and clocks "
            f"less than {WIDEST_S:g} s apart",
        )  # fmt: skip
    offset_ms, error_ms = 1e3 * estimate.offset_s, 1e3 * estimate.error_s
    detail = f"offset {offset_ms:+.0f} ms, within {max(2.0 * error_ms, 1.0):.0f} ms"
    if abs(estimate.offset_s) <= max(TOLERATED_S, 3.0 * estimate.error_s):
        return Finding(what=what, verdict="ok", detail=detail)
    return Finding(
        what=what, verdict="warning",
        detail=f"{detail}: at 1 rad/s the map is turned by {abs(0.0573 * offset_ms):.1f} degrees",
        do=f"give the profile `clock_offset_ms: {1e3 * known_s + offset_ms:.0f}` under `camera`, "
        "or stamp images when they are exposed",
    )  # fmt: skip
