"""Readers of RGB-D datasets in their original folders, with poses or without."""

import json
import math
import re
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from app.messages.images import GREY_16
from ippon.camera import PinholeCamera
from ippon.geometry import Float64Array, is_rigid, make_transform, rotation_from_quaternion

NO_READING: Final = 65535
TUM_DEPTH_UNIT_M: Final = 1.0 / 5000.0
TUM_APART_S: Final = 0.02
MILLIMETRE: Final = 1e-3
KINECT: Final = PinholeCamera(width=640, height=480, fx=585.0, fy=585.0, cx=320.0, cy=240.0)
TUM_CAMERAS: Final = {
    "freiburg1": (517.3, 516.5, 318.6, 255.3),
    "freiburg2": (520.9, 521.0, 325.1, 249.7),
    "freiburg3": (535.4, 539.2, 320.1, 247.6),
}
_STRETCH: Final = 0.02
"""Difference of the proportions of colour and depth that is accepted; ScanNet's is 0.004."""
_DAMAGED: Final = (OSError, SyntaxError, ValueError, EOFError, Image.DecompressionBombError)
"""What Pillow raises for an image that it cannot read."""
NO_POSE: Final = np.full((4, 4), np.nan)
TUM_DEFAULT: Final = (525.0, 525.0, 319.5, 239.5)


class DatasetError(Exception):
    """A dataset cannot be read; the text says why."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DatasetFrame:
    """One colour and depth image, on disk."""

    time_s: float
    """Since the first frame."""
    color: Path
    depth: Path
    T_world_camera: Float64Array
    """NaN in a dataset that was opened without poses."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Dataset:
    """A sequence of RGB-D images with poses."""

    name: str
    camera: PinholeCamera
    """Camera of the depth image; colour of another size is scaled to it."""
    depth_unit_m: float
    up_world: tuple[float, float, float]
    """Up direction in the world frame of the poses."""
    frames: tuple[DatasetFrame, ...]
    left_out: int = 0
    """Colour images that are no frames: without a depth image of their time, or a valid pose."""


def open_dataset(folder: Path, *, poses: bool = True) -> Dataset:
    """Read a dataset, recognised by its files.

    Args:
        folder: In one of the known formats.
        poses: Read the poses, and only frames that have one. Without, ours (sequence.json) and TUM
            RGB-D need none.

    Raises:
        DatasetError: The format is unknown, or the data are damaged.
    """
    readers: tuple[tuple[str, Callable[[Path, bool], Dataset]], ...] = (
        ("sequence.json", _read_sequence),
        ("groundtruth.txt" if poses else "rgb.txt", _read_tum),
        ("frame-000000.pose.txt", _read_seven_scenes),
        ("intrinsic/intrinsic_depth.txt", _read_scannet),
    )
    for name, read in readers:
        if (folder / name).exists():
            try:
                dataset = read(folder, poses)
            except KeyError as error:
                raise DatasetError(f"{folder / name} lacks the field {error}") from error
            except (OSError, ValueError, TypeError, IndexError) as error:
                raise DatasetError(f"{folder / name} is damaged: {error}") from error
            if poses:
                dataset = _with_poses(dataset)
            if not dataset.frames:
                raise DatasetError(_no_frames(folder, dataset, poses))
            return dataset
    raise DatasetError(
        f"{folder} is not a known dataset: TUM RGB-D has groundtruth.txt, 7-Scenes "
        "frame-000000.pose.txt, ScanNet intrinsic/intrinsic_depth.txt, ours sequence.json; a bag "
        "is a .mcap file or a folder with metadata.yaml"
    )


def _no_frames(folder: Path, dataset: Dataset, poses: bool) -> str:
    if not poses:
        return f"{folder} has no frame with colour and depth"
    why = (
        f": {dataset.left_out} colour images have no depth image of their time, or no pose that is "
        "a rotation (right-handed, without scale) and a position"
        if dataset.left_out
        else ""
    )
    return f"{folder} has no frame with colour, depth and pose{why}"


def read_color(path: Path, camera: PinholeCamera) -> NDArray[np.uint8]:
    """Return a colour image (H, W, 3) in the size of the camera.

    Raises:
        DatasetError: It cannot be read, or has other proportions than the camera.
    """
    with _opened(path) as image:
        size = (camera.width, camera.height)
        stretch = image.width * camera.height / (image.height * camera.width)
        if not 1.0 - _STRETCH < stretch < 1.0 + _STRETCH:
            raise DatasetError(
                f"{path} is an image of {image.width}x{image.height}; colour and depth of this "
                f"dataset are of one view, {camera.width}x{camera.height}: register one to the "
                "other first"
            )
        rgb = image.convert("RGB")
        return np.asarray(rgb if rgb.size == size else rgb.resize(size, Image.Resampling.BOX))


def read_depth(path: Path, unit_m: float, camera: PinholeCamera) -> NDArray[np.float32]:
    """Return a depth image (H, W) in metres, 0 where there is no reading.

    Raises:
        DatasetError: It cannot be read, is no depth image, or has another size than the camera.
    """
    with _opened(path) as image:
        if image.mode not in GREY_16 or image.size != (camera.width, camera.height):
            raise DatasetError(
                f"{path} is an image of {image.width}x{image.height} in the mode {image.mode}; the "
                f"camera of this dataset takes depth of {camera.width}x{camera.height}, grey of 16 "
                "bits"
            )
        values = np.asarray(image).astype(np.uint16, copy=True)
    values[values == NO_READING] = 0
    return values.astype(np.float32) * np.float32(unit_m)


def _opened(path: Path) -> Image.Image:
    image: Image.Image | None = None
    try:
        image = Image.open(path)
        image.load()
    except _DAMAGED as error:
        if image is not None:
            image.close()
        raise DatasetError(f"cannot read the image {path}: {error}") from error
    return image


def _read_sequence(folder: Path, poses: bool) -> Dataset:
    content: dict[str, Any] = json.loads((folder / "sequence.json").read_text("utf-8"))
    if poses and not all("camera_to_world" in entry for entry in content["frames"]):
        raise DatasetError(
            f"{folder} has frames without a pose: they can be tracked, with `ippon recognise "
            "--track`, or `ippon replay --no-poses` and the profile hand-held"
        )
    k = content["intrinsics"]
    x, y, z = _up_world(content["gravity_world"])
    rate_hz = _rate_hz(content["rate_hz"])
    frames = [
        DatasetFrame(
            time_s=n / rate_hz,
            color=folder / entry["color"],
            depth=folder / entry["depth"],
            T_world_camera=_stated_pose(n, entry["camera_to_world"]) if poses else NO_POSE,
        )
        for n, entry in enumerate(content["frames"])
    ]
    return Dataset(
        name=str(content["name"]),
        camera=PinholeCamera(width=content["width"], height=content["height"], **k),
        depth_unit_m=float(content["depth_unit_m"]),
        up_world=(x, y, z),
        frames=tuple(frames),
    )


def _rate_hz(rate: Any) -> float:
    rate_hz = float(rate)
    if not 0.0 < rate_hz < math.inf:
        raise DatasetError(
            f"rate_hz of sequence.json is {rate!r}; it takes images a second, such as 30"
        )
    return rate_hz


def _up_world(gravity: Any) -> tuple[float, float, float]:
    try:
        x, y, z = (-float(g) for g in gravity)
    except (ValueError, TypeError):
        x = y = z = 0.0
    if not 0.0 < math.hypot(x, y, z) < math.inf:
        raise DatasetError(
            f"gravity_world of sequence.json is {gravity!r}; it takes three numbers, the direction "
            "in which things fall, such as [0, 0, -1]"
        )
    return x, y, z


def _stated_pose(n: int, rows: Any) -> Float64Array:
    pose = np.array(rows, np.float64)
    if pose.shape != (4, 4):
        raise DatasetError(
            f"frame {n} of sequence.json: camera_to_world has the shape {pose.shape}; it is 4 rows "
            "of 4 numbers, metres"
        )
    return pose


def _read_tum(folder: Path, poses: bool) -> Dataset:
    colors, depths = _tum_list(folder / "rgb.txt"), _tum_list(folder / "depth.txt")
    known_poses = [
        (float(row[0]), _tum_pose([float(value) for value in row[1:8]]))
        for row in (_tum_rows(folder / "groundtruth.txt") if poses else [])
    ]
    frames: list[DatasetFrame] = []
    for at, color in colors:
        depth = _nearest(depths, at)
        pose = _nearest(known_poses, at) if poses else NO_POSE
        if depth is not None and pose is not None:
            frames.append(
                DatasetFrame(
                    time_s=at - colors[0][0],
                    color=folder / color,
                    depth=folder / depth,
                    T_world_camera=pose,
                )
            )
    known = next((c for name, c in TUM_CAMERAS.items() if name in folder.resolve().name), None)
    fx, fy, cx, cy = known or TUM_DEFAULT
    return Dataset(
        name=folder.resolve().name,
        camera=PinholeCamera(width=640, height=480, fx=fx, fy=fy, cx=cx, cy=cy),
        depth_unit_m=TUM_DEPTH_UNIT_M,
        up_world=(0.0, 0.0, 1.0),
        frames=tuple(frames),
        left_out=len(colors) - len(frames),
    )


def _tum_rows(path: Path) -> list[list[str]]:
    lines = path.read_text("ascii").splitlines()
    return [line.split() for line in lines if line.strip() and not line.startswith("#")]


def _tum_list(path: Path) -> list[tuple[float, str]]:
    return sorted((float(row[0]), row[1]) for row in _tum_rows(path))


def _tum_pose(row: list[float]) -> Float64Array:
    tx, ty, tz, qx, qy, qz, qw = row
    return make_transform(rotation_from_quaternion((qw, qx, qy, qz)), (tx, ty, tz))


def _nearest(entries: list[tuple[float, Any]], at: float) -> Any:
    """Return the entry of the nearest time, None if it is too far."""
    k = bisect_left(entries, at, key=lambda entry: entry[0])
    near = min(entries[max(0, k - 1) : k + 1], key=lambda e: abs(e[0] - at), default=None)
    return near[1] if near is not None and abs(near[0] - at) <= TUM_APART_S else None


def _read_pose(path: Path) -> Float64Array:
    try:
        return np.loadtxt(path)
    except (OSError, ValueError) as error:
        raise DatasetError(f"{path} is damaged: {error}") from error


def _read_seven_scenes(folder: Path, poses: bool) -> Dataset:
    pose_files = sorted(folder.glob("frame-*.pose.txt"))
    frames = [
        DatasetFrame(
            time_s=n / 30.0,
            color=path.with_name(path.name.replace(".pose.txt", ".color.png")),
            depth=path.with_name(path.name.replace(".pose.txt", ".depth.png")),
            T_world_camera=_read_pose(path) if poses else NO_POSE,
        )
        for n, path in enumerate(pose_files)
    ]
    return Dataset(
        name=folder.resolve().name,
        camera=KINECT,
        depth_unit_m=MILLIMETRE,
        # The world frame is that of the first camera, held about level: y points down.
        up_world=(0.0, -1.0, 0.0),
        frames=tuple(frames),
    )


def _read_scannet(folder: Path, poses: bool) -> Dataset:
    k = np.loadtxt(folder / "intrinsic" / "intrinsic_depth.txt")
    paths = sorted((folder / "pose").glob("*.txt"), key=lambda p: int(re.sub(r"\D", "", p.stem)))
    if not paths:
        raise DatasetError(f"{folder / 'pose'} holds no pose")
    frames = [
        DatasetFrame(
            time_s=int(path.stem) / 30.0,
            color=folder / "color" / f"{path.stem}.jpg",
            depth=folder / "depth" / f"{path.stem}.png",
            T_world_camera=_read_pose(path) if poses else NO_POSE,
        )
        for path in paths
    ]
    with _opened(frames[0].depth) as image:
        width, height = image.size
    return Dataset(
        name=folder.resolve().name,
        camera=PinholeCamera(
            width=width, height=height, fx=float(k[0, 0]), fy=float(k[1, 1]),
            cx=float(k[0, 2]), cy=float(k[1, 2]),
        ),
        depth_unit_m=MILLIMETRE,
        up_world=(0.0, 0.0, 1.0),
        frames=tuple(frames),
    )  # fmt: skip


def _with_poses(dataset: Dataset) -> Dataset:
    """Skip frames without a valid pose: trackers write NaN or infinity where tracking was lost."""
    frames = tuple(
        replace(frame, T_world_camera=_rigid(frame.T_world_camera))
        for frame in dataset.frames
        if is_rigid(frame.T_world_camera, 1e-2)
    )
    left_out = dataset.left_out + len(dataset.frames) - len(frames)
    return replace(dataset, frames=frames, left_out=left_out)


def _rigid(pose: Float64Array) -> Float64Array:
    """Return a pose with the nearest rotation: files round theirs, some to three decimals."""
    u, _, vt = np.linalg.svd(pose[:3, :3])
    return make_transform(u @ vt, pose[:3, 3])
