"""Colour, depth and intrinsics of a robot's camera."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.doctor.finding import Finding
from app.doctor.robot.alignment import edge_score
from app.doctor.robot.clocks import rate_hz, rate_verdict
from app.doctor.robot.samples import Arrival, Samples
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.depth.depth_images import DEPTH_DECODERS
from app.messages.images import COLOR_DECODERS, PAIRED_S, StampedCamera, decode_camera
from ippon.frame import NANOSECONDS

T = TypeVar("T")
DARK: Final = 8.0
"""Mean of a colour image, of 255, below which it is black."""
FEW: Final = 0.2
"""Share of pixels with depth below which there is little."""
FAR_M: Final = 50.0
NEAR_M: Final = 0.05
SHIFT_SHARE: Final = 0.012
BETTER: Final = 1.15
"""Factor by which another shift must fit better before depth counts as shifted."""
COMPARED: Final = 5


@dataclass(slots=True, kw_only=True)
class CameraCheck:
    """The camera's images, and what is to be said about them."""

    findings: list[Finding]
    colors: dict[int, NDArray[np.uint8]] = field(default_factory=dict[int, NDArray[np.uint8]])
    """(H, W, 3) RGB by stamp."""
    depths: dict[int, NDArray[np.float32]] = field(default_factory=dict[int, NDArray[np.float32]])
    """(H, W) metres by stamp."""
    camera: StampedCamera | None = None

    def pairs(self) -> list[tuple[int, NDArray[np.uint8], NDArray[np.float32]]]:
        """Return stamp, colour and depth of the images that belong together, oldest first."""
        if not self.depths:
            return []
        stamps = np.array(sorted(self.depths))
        found: list[tuple[int, NDArray[np.uint8], NDArray[np.float32]]] = []
        for stamp, color in sorted(self.colors.items()):
            nearest = int(stamps[int(np.argmin(np.abs(stamps - stamp)))])
            if abs(nearest - stamp) <= PAIRED_S * NANOSECONDS:
                found.append((stamp, color, self.depths[nearest]))
        return found


def check_camera(samples: Samples) -> CameraCheck:
    """Check colour, depth, intrinsics, and whether they belong together."""
    check = CameraCheck(findings=[])
    _check_color(samples, check)
    _check_depth(samples, check)
    _check_info(samples, check)
    _check_pairs(check)
    return check


def read_all(
    arrivals: list[Arrival], decode: Callable[[bytes], T]
) -> tuple[list[tuple[Arrival, T]], str]:
    """Return the messages that can be read, and the problem of the last that cannot."""
    read: list[tuple[Arrival, T]] = []
    problem = ""
    for arrival in arrivals:
        if not arrival.payload:
            continue
        try:
            read.append((arrival, decode(arrival.payload)))
        except MessageError as error:
            problem = str(error)
    return read, problem


def unreadable(what: str, key: str, arrivals: list[Arrival], problem: str) -> Finding:
    """Return the finding about a stream without a readable message."""
    if arrivals:
        return Finding(
            what=what, verdict="failed", detail=f"on {key}: {problem}",
            do="the topic has another type or encoding: name the right one in `ros2` of the "
            "profile, or convert it",
        )  # fmt: skip
    return Finding(
        what=what, verdict="failed", detail=f"nothing comes on {key}",
        do="start the driver and the bridge: `python3 -m ippon_ros2 --check --profile FILE` on the "
        "robot says which topics there are; with `middleware: rmw_zenoh` see the topics above",
    )  # fmt: skip


def _check_color(samples: Samples, check: CameraCheck) -> None:
    key, arrivals = samples.of(keys.COLOR, keys.COLOR_RAW)
    read, problem = read_all(arrivals, COLOR_DECODERS[key])
    if not read:
        check.findings.append(unreadable("colour", key, arrivals, problem))
        return
    check.colors = {a.stamp_ns: image for a, image in read if a.stamp_ns is not None}
    image, hz = read[-1][1], rate_hz(arrivals)
    verdict, do = rate_verdict(hz)
    detail = f"{image.shape[1]} x {image.shape[0]}, {hz:.1f} Hz, brightness {image.mean():.0f}"
    if all(one.mean() < DARK for _, one in read):
        verdict, detail = "failed", f"black: {detail} of 255"
        do = "uncover the lens, turn on light, or let the camera set its exposure"
    check.findings.append(Finding(what="colour", verdict=verdict, detail=detail, do=do))


def _check_depth(samples: Samples, check: CameraCheck) -> None:
    key, arrivals = samples.of(keys.DEPTH, keys.DEPTH_RAW)
    read, problem = read_all(arrivals, DEPTH_DECODERS[key])
    unused = ""
    if not read:
        # As the navigator does: uncompressed images count where no others can be read.
        raw = samples.arrivals.get(keys.DEPTH_RAW, [])
        read, _ = read_all(raw, DEPTH_DECODERS[keys.DEPTH_RAW])
        if not read:
            check.findings.append(unreadable("depth", key, arrivals, problem))
            return
        arrivals, unused = raw, f"uncompressed; on {key}: {problem}"
    check.depths = {image.stamp_ns: image.depth for _, image in read}
    image = read[-1][1].depth
    valid = np.concatenate([one.depth[one.depth > 0.0] for _, one in read])
    share = len(valid) / sum(one.depth.size for _, one in read)
    hz = rate_hz(arrivals)
    size = f"{image.shape[1]} x {image.shape[0]}, {hz:.1f} Hz"
    if len(valid) == 0:
        check.findings.append(
            Finding(
                what="depth", verdict="failed", detail=f"{size}, no pixel has a depth",
                do="uncover the camera, or check that the depth topic is the right one",
            )
        )  # fmt: skip
        return
    finding = _judge_depth(valid, share, size, hz)
    if unused and finding.verdict == "ok":
        finding = replace(
            finding, verdict="warning", detail=f"{finding.detail}, {unused}",
            do="correct the topic of compressed depth, or leave it out",
        )  # fmt: skip
    check.findings.append(finding)


def _judge_depth(valid: NDArray[np.float32], share: float, size: str, hz: float) -> Finding:
    low, middle, high = (float(x) for x in np.percentile(valid, (5, 50, 95)))
    detail = f"{size}, {low:.2f} to {high:.2f} m, {share:.0%} of the pixels"
    if middle > FAR_M:
        return Finding(
            what="depth", verdict="failed",
            detail=f"{detail}: the unit seems to be millimetres in an image that must hold metres",
            do="publish 32FC1 in metres, or the same numbers as 16UC1",
        )  # fmt: skip
    if middle < NEAR_M:
        return Finding(
            what="depth", verdict="failed",
            detail=f"{detail}: the unit seems to be metres in an image that must hold millimetres",
            do="publish 16UC1 in millimetres, or 32FC1 in metres",
        )  # fmt: skip
    if share < FEW:
        return Finding(
            what="depth", verdict="warning", detail=detail,
            do="few pixels have depth: point the camera into a room, check its infrared "
            "projector, or its range in the driver",
        )  # fmt: skip
    verdict, do = rate_verdict(hz)
    return Finding(what="depth", verdict=verdict, detail=f"{detail}, unit metres", do=do)


def _check_info(samples: Samples, check: CameraCheck) -> None:
    key, arrivals = samples.of(keys.CAMERA_INFO)
    read, problem = read_all(arrivals, decode_camera)
    if not read:
        check.findings.append(unreadable("intrinsics", key, arrivals, problem))
        return
    info = check.camera = read[-1][1]
    camera = info.camera
    wide = 2.0 * np.degrees(np.arctan(0.5 * camera.width / camera.fx))
    detail = (
        f"{camera.width} x {camera.height}, {wide:.0f} degrees wide, frame {info.frame_id[:60]!r}"
    )
    sizes = {image.shape[:2] for image in (*check.colors.values(), *check.depths.values())}
    wrong = [size for size in sizes if size != (camera.height, camera.width)]
    if wrong:
        detail += f"; images of {wrong[0][1]} x {wrong[0][0]} come with it"
        do = "take camera_info of the colour camera, and depth that is registered to colour"
        check.findings.append(Finding(what="intrinsics", verdict="failed", detail=detail, do=do))
        return
    check.findings.append(Finding(what="intrinsics", verdict="ok", detail=detail))


def _check_pairs(check: CameraCheck) -> None:
    """Check that depth and colour have the same stamps, and their edges the same pixels."""
    if not check.colors or not check.depths:
        return
    pairs = check.pairs()
    share = len(pairs) / len(check.colors)
    if share < 0.5:
        check.findings.append(
            Finding(
                what="depth with colour", verdict="failed",
                detail=f"{share:.0%} of the colour images have depth within "
                f"{1000 * PAIRED_S:.0f} ms",
                do="let the driver synchronise depth and colour; both need the stamp of the shot",
            )
        )  # fmt: skip
        return
    fitting = [(c, d) for _, c, d in pairs if c.shape[:2] == d.shape]
    score = edge_score(fitting[-COMPARED:])
    if score is None:
        check.findings.append(
            Finding(
                what="depth with colour", verdict="warning",
                detail=f"{share:.0%} have the same stamp; too few edges to compare",
                do="point the camera at objects in front of a wall, and check again",
            )
        )  # fmt: skip
        return
    width = fitting[0][1].shape[1]
    shift = max(abs(x) for x in score.shift_px)
    moved = shift > max(2, SHIFT_SHARE * width) and score.best > BETTER * score.score
    detail = f"edge score {score.score:.1f} (1 is chance), {share:.0%} have the same stamp"
    if moved:
        detail += f"; {score.best:.1f} with depth moved by {score.shift_px} pixels"
    check.findings.append(
        Finding(
            what="depth with colour", verdict="warning" if moved else "ok", detail=detail,
            do="use depth that is registered to colour (align_depth, depth_registered)"
            if moved else "",
        )
    )  # fmt: skip
