"""The tree of a robot's coordinate frames, and the pose that it gives."""

from dataclasses import replace
from typing import Final

import numpy as np

from app.doctor.finding import Finding
from app.doctor.robot.clocks import rate_hz
from app.doctor.robot.images import read_all, unreadable
from app.doctor.robot.samples import MOST_POSES, Samples
from app.links.robot_streams.transforms import TransformBuffer
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.keys import BASE_FRAME, WORLD_FRAME
from app.messages.motion import (
    StampedTransform,
    decode_odometry,
    decode_transforms,
    read_transforms,
)
from app.nodes.navigator.localization.odometry_frame import OdometryFrame
from app.nodes.navigator.stream_conversion import NO_MOUNT
from ippon.robot import RobotProfile

JUMP_M: Final = 0.5
"""Step of the pose between two messages that no robot makes."""
SLOW_HZ: Final = 5.0


def check_frames(
    samples: Samples,
    optical: str | None,
    stamps_ns: list[int],
    profile: RobotProfile | None = None,
) -> list[Finding]:
    """Check that tf is a tree that leads from `map` through `base_link` to the camera.

    Args:
        samples: What the robot sent.
        optical: Frame that camera_info names; None if unknown.
        stamps_ns: Stamps of the images.
        profile: Says how the camera is carried; None if unknown.
    """
    if profile is not None and profile.tracks_pose and not samples.arrivals.get(keys.TF):
        return [_untracked(samples)]
    moving, problem = read_all(samples.arrivals.get(keys.TF, []), decode_transforms)
    fixed, fixed_problem = read_all(samples.arrivals.get(keys.TF_STATIC, []), decode_transforms)
    # As the navigator does: odometry counts where no tf comes.
    if not samples.arrivals.get(keys.TF) and samples.arrivals.get(keys.ODOM):
        return _check_odometry(samples, [t for _, ts in fixed for t in ts], optical, profile)
    if not moving and not fixed:
        return [unreadable("tf", keys.TF, samples.arrivals.get(keys.TF, []), problem)]
    parents: dict[str, set[str]] = {}
    for _, transforms in (*moving, *fixed):
        for t in transforms:
            parents.setdefault(t.child, set()).add(t.parent)
    findings = _shape_of(parents)
    if not findings:
        findings = [
            replace(one, detail="; ".join([one.detail, *_refused(samples, problem, fixed_problem)]))
            for one in _chain(parents, {t.child for _, ts in fixed for t in ts}, optical)
        ]
    if findings:
        return findings
    buffer = TransformBuffer(history=MOST_POSES)
    poses: list[StampedTransform] = []
    try:
        for read, is_fixed in ((fixed, True), (moving, False)):
            for transform in (t for _, transforms in read for t in transforms):
                buffer.add(transform, fixed=is_fixed)
    except MessageError as error:
        return [
            Finding(
                what="tf", verdict="failed", detail=str(error),
                do="publish fewer; give each of several robots its own prefix",
            )
        ]  # fmt: skip
    for stamp in stamps_ns:
        T = buffer.lookup(WORLD_FRAME, BASE_FRAME, stamp)
        if T is not None:
            poses.append(
                StampedTransform(
                    stamp_ns=stamp, parent=WORLD_FRAME, child=BASE_FRAME, T_parent_child=T
                )
            )
    return [_judge(poses, len(stamps_ns), len(parents) + 1, rate_hz(samples.of(keys.TF)[1]))]


def _untracked(samples: Samples) -> Finding:
    """Return the line of a camera whose pose the navigator finds by its images, and has not yet."""
    if samples.navigator:
        return Finding(
            what="pose", verdict="warning", detail="the navigator has not found the camera's place",
            do="point the camera at something that it has seen before, at the start at furniture "
            "with floor in front of it, and hold it still for a moment",
        )  # fmt: skip
    return Finding(
        what="pose", verdict="warning", detail="no navigator tracks the camera by its images",
        do="start `ippon navigate` with this profile",
    )  # fmt: skip


def _refused(samples: Samples, *problems: str) -> list[str]:
    """Return what is wrong with the first message or transform that is not used; else nothing."""
    texts = [text for text in problems if text]
    for key in (keys.TF, keys.TF_STATIC):
        read, _ = read_all(samples.arrivals.get(key, []), read_transforms)
        texts += [text for _, (_, refused) in read for text in refused]
    return texts[:1]


def _shape_of(parents: dict[str, set[str]]) -> list[Finding]:
    """Return where the frames are no tree: two parents, or a loop."""
    findings: list[Finding] = []
    for child, several in sorted(parents.items()):
        if len(several) > 1:
            findings.append(
                Finding(
                    what="tf", verdict="failed",
                    detail=f"{child!r} has two parents, {' and '.join(sorted(several)[:2])}",
                    do="two nodes publish it: switch one off (publish_tf: false)",
                )
            )  # fmt: skip
    for start in sorted(parents):
        way = _up(parents, start)
        if way and way[-1] in parents and way[-1] in way[:-1]:
            loop = way[way.index(way[-1]) :]
            findings.append(
                Finding(
                    what="tf", verdict="failed", detail=f"a loop: {' -> '.join(loop)}",
                    do="one of these transforms is published the wrong way round: invert it",
                )
            )  # fmt: skip
            break
    return findings


def _chain(parents: dict[str, set[str]], fixed: set[str], optical: str | None) -> list[Finding]:
    """Return what is missing between `map`, `base_link` and the camera."""
    body = _body(parents, fixed)
    known = parents.keys() | {p for several in parents.values() for p in several}
    wanted = [name for name in (BASE_FRAME, optical) if name]
    for name in wanted:
        way = _up(parents, name)
        if WORLD_FRAME in way and (name == BASE_FRAME or body & set(way)):
            continue
        detail = f"no way from {WORLD_FRAME!r} to {name!r}"
        if name not in known:
            detail += f": nothing names {name!r}; there is {', '.join(sorted(known)[:6])}"
        elif WORLD_FRAME in way:
            detail = f"{name!r} hangs on {way[1]!r} and not on {BASE_FRAME!r}"
        elif way == [name]:
            detail += f": nothing is above {name!r}; there is {', '.join(sorted(known)[:6])}"
        else:
            detail += f": it ends at {way[-1]!r}"
        do = "publish the missing transform (static_transform_publisher)"
        if name == BASE_FRAME and name not in known:
            do = (
                f"the base must be called {BASE_FRAME!r}: publish a fixed transform from the frame "
                "that it has to that name (static_transform_publisher)"
            )
        elif name == BASE_FRAME:
            do += "; a robot without a map frame publishes a fixed one from 'map' to 'odom'"
        return [Finding(what="tf", verdict="failed", detail=detail, do=do)]
    return []


def _body(parents: dict[str, set[str]], fixed: set[str]) -> set[str]:
    """Return `base_link` and the frames above that it is fixed to, such as `base_footprint`."""
    body = {BASE_FRAME}
    for name in _up(parents, BASE_FRAME):
        if name == WORLD_FRAME:
            break
        body.add(name)
        if name not in fixed:
            break
    return body


def _up(parents: dict[str, set[str]], name: str) -> list[str]:
    """Return the frames from one upwards; the last is repeated where there is a loop."""
    way = [name]
    while way[-1] in parents and way.count(way[-1]) == 1:
        way.append(min(parents[way[-1]]))
    return way


def _judge(poses: list[StampedTransform], images: int, frames: int, hz: float) -> Finding:
    share = len(poses) / images if images else 0.0
    detail = f"{frames} frames, {hz:.0f} Hz, a pose for {share:.0%} of the images"
    if images and share < 0.5:
        return Finding(
            what="tf", verdict="failed", detail=detail,
            do="the stamps of tf and images do not overlap: see the clocks above, or raise tf's "
            "rate to 20 Hz",
        )  # fmt: skip
    return _judge_motion(poses, detail, hz)


def _judge_motion(poses: list[StampedTransform], detail: str, hz: float) -> Finding:
    at = np.array([p.T_parent_child[:3, 3] for p in poses]).reshape(-1, 3)
    step = float(np.linalg.norm(np.diff(at, axis=0), axis=1).max(initial=0.0))
    if step > JUMP_M:
        return Finding(
            what="pose", verdict="warning", detail=f"{detail}; it jumps by {step:.1f} m",
            do="localisation jumps: let it settle before a search, since a map is not moved",
        )  # fmt: skip
    if hz < SLOW_HZ:
        return Finding(
            what="pose", verdict="warning", detail=detail,
            do="publish the pose 20 times a second: it is interpolated between messages",
        )  # fmt: skip
    return Finding(what="pose", verdict="ok", detail=detail)


def _check_odometry(
    samples: Samples,
    fixed: list[StampedTransform],
    optical: str | None,
    profile: RobotProfile | None,
) -> list[Finding]:
    if profile is not None and profile.can_tilt:
        return [Finding(what="odometry", verdict="failed", detail=NO_MOUNT)]
    arrivals = samples.arrivals[keys.ODOM]
    read, problem = read_all(arrivals, decode_odometry)
    if not read:
        return [unreadable("odometry", keys.ODOM, arrivals, problem)]
    frame = OdometryFrame()
    try:
        frame.add_fixed(fixed)
        for _, pose in read:
            frame.base_in(pose.child, optical)
    except MessageError as error:
        return [Finding(what="odometry", verdict="failed", detail=str(error))]
    hz = rate_hz(arrivals)
    return [_judge_motion([pose for _, pose in read], f"odometry, {hz:.0f} Hz", hz)]
