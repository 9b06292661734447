"""All checks of a live robot, in the order in which they are to be read."""

import math

from app.doctor.finding import Finding
from app.doctor.robot.clock_offset import check_offset
from app.doctor.robot.clocks import check_clocks
from app.doctor.robot.command_loop import check_commands
from app.doctor.robot.frames import check_frames
from app.doctor.robot.images import CameraCheck, check_camera
from app.doctor.robot.samples import MOST_POSES, Samples
from app.links.robot_streams.transforms import TransformBuffer
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.images import StampedCamera
from app.messages.keys import BASE_FRAME, WORLD_FRAME
from app.messages.motion import decode_transforms
from app.nodes.navigator.profile_check import depth_unit_mismatch, profile_mismatches
from ippon.errors import FrameRejectedError
from ippon.frame import Frame
from ippon.geometry import Float64Array, invert_transform
from ippon.robot import RobotProfile


def check_robot(
    samples: Samples, profile: RobotProfile | None = None, clock_offset_s: float = 0.0
) -> list[Finding]:
    """Return a line for each stream, for the frames and for the commands.

    Args:
        samples: What the robot sent.
        profile: Compared with its camera; None for no comparison.
        clock_offset_s: What the profile says about the camera's clock.
    """
    findings = check_streams(samples, profile, clock_offset_s, is_live=True)
    heard = not any(finding.verdict == "failed" for finding in findings)
    return [*findings, *check_commands(samples, profile, expects_commands=heard)]


def check_streams(
    samples: Samples,
    profile: RobotProfile | None = None,
    clock_offset_s: float = 0.0,
    *,
    is_live: bool = False,
) -> list[Finding]:
    """Return a line for each stream and for the frames.

    Args:
        samples: What the robot sent.
        profile: Compared with its camera; None for no comparison.
        clock_offset_s: What the profile says about the camera's clock.
        is_live: It was sent now, by the clock of this machine.
    """
    camera = check_camera(samples)
    clocks = check_clocks(samples, clock_offset_s, is_live=is_live)
    findings = [*camera.findings, *clocks]
    optical = None if camera.camera is None else camera.camera.frame_id
    offset_ns = round(1e9 * clock_offset_s)
    stamps_ns = sorted(s + offset_ns for s in camera.colors)
    findings += check_frames(samples, optical, stamps_ns, profile)
    if camera.camera is not None and camera.depths:
        findings.append(_check_offset(samples, camera, camera.camera, clock_offset_s))
    if profile is not None:
        findings += _check_profile(samples, camera, profile, clock_offset_s)
    elif not any(f.what == "depth" and f.verdict == "failed" for f in findings):
        findings += _check_depth_unit(samples, camera, clock_offset_s)
    return findings


def _check_depth_unit(
    samples: Samples, camera: CameraCheck, clock_offset_s: float
) -> list[Finding]:
    frame = last_frame(samples, camera, clock_offset_s)
    wrong = None if frame is None else depth_unit_mismatch(frame)
    do = "publish 16UC1 in millimetres, or 32FC1 in metres"
    return [] if wrong is None else [Finding(what="depth", verdict="failed", detail=wrong, do=do)]


def _check_profile(
    samples: Samples, camera: CameraCheck, profile: RobotProfile, clock_offset_s: float
) -> list[Finding]:
    frame = last_frame(samples, camera, clock_offset_s)
    if frame is None:
        return [
            Finding(
                what="profile", verdict="warning",
                detail="not compared: there is no image with depth and a pose by tf",
            )
        ]  # fmt: skip
    wrong = profile_mismatches(profile, frame)
    if not wrong and samples.is_mount_assumed:
        detail = (
            f"{profile.name}: the view of the camera agrees; its height, place and tilt are not "
            "compared: the poses are computed with the mount of a profile"
        )
        return [Finding(what="profile", verdict="ok", detail=detail)]
    if not wrong:
        detail = f"{profile.name}: height, place, tilt and view of the camera agree"
        return [Finding(what="profile", verdict="ok", detail=detail)]
    do = "correct the profile, or the transform that is wrong"
    return [Finding(what="profile", verdict="failed", detail=text, do=do) for text in wrong]


def _check_offset(
    samples: Samples, check: CameraCheck, camera: StampedCamera, clock_offset_s: float
) -> Finding:
    buffer, frame = _transforms_of(samples), camera.frame_id

    def pose_at(stamp_ns: int) -> Float64Array | None:
        return buffer.lookup(WORLD_FRAME, frame, stamp_ns + round(1e9 * clock_offset_s))

    return check_offset(sorted(check.depths.items()), camera.camera, pose_at, clock_offset_s)


def _transforms_of(samples: Samples) -> TransformBuffer:
    buffer = TransformBuffer(history=MOST_POSES)
    for key in (keys.TF_STATIC, keys.TF):
        for arrival in samples.arrivals.get(key, []):
            try:
                for transform in decode_transforms(arrival.payload):
                    buffer.add(transform, fixed=key == keys.TF_STATIC)
            except MessageError:
                continue
    return buffer


def last_frame(samples: Samples, camera: CameraCheck, clock_offset_s: float = 0.0) -> Frame | None:
    """Return the newest colour image with depth and poses by tf; None where there is none.

    Args:
        samples: What the robot sent.
        camera: Its images.
        clock_offset_s: How far the camera's clock is behind that of the poses.
    """
    if camera.camera is None:
        return None
    buffer, offset_ns = _transforms_of(samples), round(1e9 * clock_offset_s)
    for stamp, color, depth in reversed(camera.pairs()):
        T_world_camera = buffer.lookup(WORLD_FRAME, camera.camera.frame_id, stamp + offset_ns)
        T_world_base = buffer.lookup(WORLD_FRAME, BASE_FRAME, stamp + offset_ns)
        if T_world_camera is None or T_world_base is None:
            continue
        ahead = (invert_transform(T_world_base) @ T_world_camera)[:3, 2]
        try:
            return Frame(
                stamp_ns=stamp,
                color=color,
                depth=depth,
                camera=camera.camera.camera,
                T_world_camera=T_world_camera,
                T_world_base=T_world_base,
                tilt_rad=math.asin(min(1.0, max(-1.0, float(ahead[2])))),
            )
        except (FrameRejectedError, ValueError):
            return None
    return None
