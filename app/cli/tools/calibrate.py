"""`ippon calibrate`: fits an observation model to recordings with known objects."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from app.cli.nodes.segment import segmenter_of
from app.cli.options.recognition import Calibrate
from app.datasets.bag_robot import read_bag_robot
from app.datasets.dataset import DatasetError
from app.errors import UsageError
from app.recognition.calibration import (
    Calibrated,
    CalibrationError,
    CalibrationRecording,
    calibrate,
    read_known_objects,
)
from app.recognition.frames import open_source
from app.recognition.recognition import labels_of
from ippon.atomic_file import replace_file
from ippon.calibration.known_objects import KnownObjectsError
from ippon.segmentation.errors import SegmentationError
from ippon.segmentation.segmenter import Segmenter
from ippon.vocabulary import MATTERPORT_40

KNOWN_OBJECTS: Final = "objects.json"


def run_calibrate(command: Calibrate) -> int:
    """Run every frame through the network; fit, write and print a table."""
    if not command.out.parent.is_dir():
        raise UsageError(f"--out: the folder {command.out.parent} does not exist")
    try:
        robot = read_bag_robot(command.profile, command.base_frame)
        sources = [
            open_source(
                path, command.floor_m, names=robot.names, mount=robot.T_base_camera,
                clock_offset_s=robot.clock_offset_s, base=robot.base,
            )
            for path in command.recordings
        ]  # fmt: skip
        for note in filter(None, (source.note for source in sources)):
            print(f"ippon: {note}", file=sys.stderr)
        files = [command.known or _known_beside(path) for path in command.recordings]
        known = [read_known_objects(path) for path in files]
        every = tuple(dict.fromkeys(label for one in known for label in one.labels))
        segmenter = segmenter_of(command.segmentation)
        told = _told(segmenter, every)
        labels = tuple(dict.fromkeys((*MATTERPORT_40, *told)))
        recordings = [
            CalibrationRecording(
                source, one, [name for name in one.labels if name in told], command.voxel_size_m
            )
            for source, one in zip(sources, known, strict=True)
        ]
        _read(recordings, segmenter, labels)
        for source in sources:
            if source.tally.note:
                print(f"ippon: {source.path}: {source.tally.note}", file=sys.stderr)
        result = calibrate(recordings, len(labels))
    except (
        DatasetError, SegmentationError, KnownObjectsError, CalibrationError, ValueError,
    ) as error:  # fmt: skip
        raise UsageError(str(error)) from error
    content = json.dumps(result.model.as_dict(), indent=2) + "\n"
    try:
        replace_file(command.out, content.encode())
    except OSError as error:
        raise UsageError(f"cannot write {command.out}: {error}") from error
    _show(result, command.out)
    return 0


def _known_beside(recording: Path) -> Path:
    """Return the known objects beside a recording, in its folder.

    Raises:
        UsageError: There are none.
    """
    beside = (recording if recording.is_dir() else recording.parent) / KNOWN_OBJECTS
    if not beside.exists():
        raise UsageError(
            f"there is no {beside}: list the objects that you know in it (`ippon calibrate --help` "
            "has an example), or name another file with --known"
        )
    return beside


def _told(segmenter: Segmenter, names: Sequence[str]) -> list[str]:
    """Return the known labels that the network recognises; report the others."""
    label_of = labels_of(segmenter, names)
    told = [name for name, label in label_of.items() if label == name]
    if others := ", ".join(sorted(set(names) - set(label_of))):
        print(f"ippon: this network cannot recognise {others}: not used", file=sys.stderr)
    for name, label in sorted(label_of.items()):
        if label != name:
            print(
                f"ippon: this network's label for {name} is {label}: not used, list it as {label}",
                file=sys.stderr,
            )
    if not told:
        raise CalibrationError("the network can recognise none of the known objects")
    return told


def _read(
    recordings: Sequence[CalibrationRecording], segmenter: Segmenter, labels: Sequence[str]
) -> None:
    with Progress(console=Console(file=sys.stderr), transient=True) as progress:
        for one in recordings:
            task = progress.add_task(one.name, total=one.source.count)
            one.read(
                lambda frame: segmenter.segment(frame.color, labels, None),
                lambda n, task=task: progress.update(task, completed=n),
            )


def _show(result: Calibrated, out: Path) -> None:
    console = Console()
    table = Table("score", "nats before", "nats now", title=result.model.source)
    new, old = result.model.table, result.before.table
    before = old.log_ratios("scores")
    table.add_row("not recognised", f"{old.not_recognised:+.1f}", f"{new.not_recognised:+.1f}")
    for score, nats in zip(new.scores, new.nats, strict=True):
        table.add_row(f"{score:.1f}", f"{before[round(255 * score)]:+.1f}", f"{nats:+.1f}")
    console.print(table)
    held = Table("held out", "log loss before", "now", "objects found", "voxels wrong")
    for one in result.folds:
        a, b = one.before, one.fitted
        held.add_row(
            one.held_out,
            f"{a.log_loss:.1f}",
            f"{b.log_loss:.1f}",
            f"{a.believed} → {b.believed} of {b.objects}",
            f"{a.wrong_voxels} → {b.wrong_voxels}",
        )
    if result.folds:
        console.print(held)
    print(f"written to {out}; use it with --observation-model {out}")
    if not result.folds:
        print("ippon: too few observations for a test: record more", file=sys.stderr)
    elif not result.helps:
        print(
            "ippon: on held-out data it is no better than the previous table: keep that one, "
            "or calibrate with more objects",
            file=sys.stderr,
        )
