"""`ippon recognise`: finds objects in a recording with network and map."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.progress import Progress

from app.cli.nodes.segment import segmenter_of
from app.cli.options.recognition import Recognise
from app.datasets.bag_robot import read_bag_robot
from app.datasets.dataset import DatasetError
from app.errors import UsageError
from app.recognition.frames import open_source
from app.recognition.page import page_of
from app.recognition.recognition import (
    RecognisedFind,
    Recognition,
    given_labels,
    in_own_world,
    labels_of,
    recognise,
)
from ippon.atomic_file import replace_file
from ippon.frame import Frame
from ippon.observation import Heatmap, Observation
from ippon.observation_model import (
    ObservationModel,
    ObservationModelError,
    ObservationModels,
    read_observation_model,
)
from ippon.segmentation.detectors.vocabulary import unsupported_reason
from ippon.segmentation.errors import SegmentationError
from ippon.segmentation.segmenter import Segmenter
from ippon.tracking.upright import UPSIDE_DOWN
from ippon.vocabulary import canonical_label

_WORLD_UPSIDE_DOWN: Final = (
    "the world of the poses is upside down, by the depth of the images: the floor faces down and "
    "counts as ceiling; turn the world by 180 degrees, so that its z axis points up"
)
NOTHING_TOLD: Final = 2
"""Exit status where the network can tell none of the objects."""


def run_recognise(command: Recognise) -> int:
    """Run every frame through network and map, and print the finds."""
    names_asked = dict.fromkeys(map(canonical_label, command.find.split(",")))
    objects = [name for name in names_asked if name]
    if command.page is not None and not command.page.parent.is_dir():
        raise UsageError(f"--page: the folder {command.page.parent} does not exist")
    if not objects:
        raise UsageError("--find takes comma-separated objects, such as cup,tv")
    try:
        robot = read_bag_robot(command.profile, command.base_frame)
        source = open_source(
            command.path, command.floor_m, track=command.track, names=robot.names,
            mount=robot.T_base_camera, clock_offset_s=robot.clock_offset_s,
            base=robot.base,
        )  # fmt: skip
        if source.note:
            print(f"ippon: {source.note}", file=sys.stderr)
        path = command.observation_model
        own = None if path is None else read_observation_model(path)
        if own is not None and own.note:
            print(f"ippon: {own.note}", file=sys.stderr)
        models = ObservationModels([] if own is None else [own])
        segmenter = segmenter_of(command.segmentation)
        label_of = labels_of(segmenter, objects)
        if command.segmentation.backend == "installed":
            label_of = given_labels(segmenter, source, label_of)
        _report_unknown(segmenter, [name for name in objects if name not in label_of])
        if not label_of:
            for name in objects:
                _print(name, [], as_json=command.json)
            return NOTHING_TOLD
        labels = tuple(dict.fromkeys(label_of.values()))
        recognition = Recognition(labels, models, voxel_size_m=command.voxel_size_m)
        with Progress(console=Console(file=sys.stderr), transient=True) as progress:
            task = progress.add_task("frames", total=source.count)
            recognise(
                source,
                recognition,
                lambda frame, labels: _observed(segmenter, frame, labels, own),
                lambda n: progress.update(task, completed=n),
            )
        # The page reads the recording again.
        left_out = source.tally.note
        for name in objects:
            label = label_of.get(name)
            finds = [] if label is None else in_own_world(recognition, label, source.T_map_world)
            _print(name, finds, as_json=command.json)
        if command.page is not None:
            network = command.segmentation.model or command.segmentation.backend
            page = page_of(recognition, source, objects, label_of, Path(network).stem)
            _write_page(command.page, page)
            print(f"ippon: {command.page} shows the evidence", file=sys.stderr)
    except (DatasetError, SegmentationError, ObservationModelError, ValueError, OSError) as error:
        raise UsageError(str(error)) from error
    _report_frames(recognition, left_out)
    return 0


def _report_frames(recognition: Recognition, left_out: str) -> None:
    """Print what a user should know of the frames."""
    if left_out:
        print(f"ippon: {left_out}", file=sys.stderr)
    if recognition.refused:
        print(
            f"ippon: {recognition.refused} of {recognition.frames} frames were refused; the last "
            f"one: {recognition.refusal}",
            file=sys.stderr,
        )
    if recognition.invalid_boxes > recognition.boxes:
        print(
            f"ippon: {recognition.invalid_boxes} boxes of the network were not used, being outside "
            f"the image, empty or with scores outside 0 to 1, and {recognition.boxes} were: its "
            "file may have been exported in another way than its make says, which "
            "--segmentation.family names",
            file=sys.stderr,
        )
    if recognition.depth_note:
        print(f"ippon: {recognition.depth_note}", file=sys.stderr)
    if recognition.upright.is_upside_down:
        print(f"ippon: {UPSIDE_DOWN}", file=sys.stderr)
    if recognition.upright.is_world_upside_down:
        print(f"ippon: {_WORLD_UPSIDE_DOWN}", file=sys.stderr)
    if recognition.dropped:
        print(
            "ippon: the recording exceeds the maps' memory and the oldest parts were dropped: "
            "search for fewer objects per run, or use --voxel-size-m 0.1",
            file=sys.stderr,
        )


def _write_page(path: Path, page: str) -> None:
    try:
        replace_file(path, page.encode())
    except OSError as error:
        raise UsageError(f"cannot write {path}: {error}") from error


def _observed(
    segmenter: Segmenter, frame: Frame, labels: Sequence[str], own: ObservationModel | None
) -> Observation:
    """Return what the network sees; raises ObservationModelError for a model of another one."""
    seen = segmenter.segment(frame.color, labels, None)
    if own is not None:
        own.check_network(seen.source, seen.kind if isinstance(seen, Heatmap) else "scores")
    return seen


def _report_unknown(segmenter: Segmenter, objects: list[str]) -> None:
    for name in objects:
        reason = unsupported_reason(segmenter, name)
        print(f"ippon: {reason or f'this network gives no label {name!r}'}", file=sys.stderr)


def _print(name: str, finds: list[RecognisedFind], *, as_json: bool) -> None:
    if as_json:
        print(json.dumps({"object": name, "finds": [find.as_dict() for find in finds]}))
        return
    print(f"{name}: {len(finds) or 'none'}")
    for find in finds:
        x, y, z = find.position_world
        print(
            f"  p {find.probability:.2f} at ({x:.2f}, {y:.2f}, {z:.2f}) m, {find.size_m:.2f} m "
            f"long{f', in {find.images} images' if find.images else ''}"
        )
