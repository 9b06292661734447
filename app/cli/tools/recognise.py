"""`ippon recognise`: objects in a recording, through network and map."""

import json
import sys
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from app.cli.options.commands import Recognise
from app.cli.options.segmentation import RecogniseSegmentation, Segmentation
from app.cli.processes.segment import segmenter_of
from app.errors import UsageError
from app.nodes.replay.datasets import DatasetError
from app.recognition.frames import open_source
from app.recognition.recognition import (
    Observe,
    RecognisedFind,
    Recognition,
    in_own_world,
    recognise,
)
from ippon.observation_model import (
    ObservationModelError,
    ObservationModels,
    read_observation_model,
)
from ippon.segmentation.detectors.nanodet import NanoDetSegmenter
from ippon.segmentation.errors import SegmentationError
from ippon.vocabulary import canonical_label


def run_recognise(command: Recognise) -> int:
    """Run every frame through network and map, and print the finds."""
    objects = [name for name in map(canonical_label, command.find.split(",")) if name]
    if not objects:
        raise UsageError("--find names the objects, with commas between, such as cup,tv")
    try:
        source = open_source(command.path, command.floor_m)
        own = command.observation_model
        models = ObservationModels([] if own is None else [read_observation_model(own)])
        recognition = Recognition(objects, models, voxel_size_m=command.voxel_size_m)
        observe, unknown = _network(command.segmentation, objects)
        with Progress(console=Console(file=sys.stderr), transient=True) as progress:
            task = progress.add_task("frames", total=source.count)
            recognise(source, recognition, observe, lambda n: progress.update(task, completed=n))
        for name in objects:
            _print(name, in_own_world(recognition, name, source.T_map_world), as_json=command.json)
    except (DatasetError, SegmentationError, ObservationModelError, ValueError) as error:
        raise UsageError(str(error)) from error
    if recognition.refused:
        print(f"ippon: {recognition.refused} frames were refused", file=sys.stderr)
    return 2 if len(unknown) == len(objects) else 0


def _network(options: RecogniseSegmentation, objects: list[str]) -> tuple[Observe, list[str]]:
    """Load the network; returns it and the objects that it cannot tell, which are said."""
    if options.backend != "detector":
        plain = Segmentation(
            **{name: getattr(options, name) for name in Segmentation.__dataclass_fields__}
        )
        segmenter = segmenter_of(plain)
        return lambda frame, labels: segmenter.segment(frame.color, labels, None), []
    if not options.model:
        raise UsageError(
            "the detector needs its file: --segmentation.model FILE.param, with FILE.bin beside it"
        )
    detector = NanoDetSegmenter(Path(options.model).expanduser())
    reasons = {name: detector.vocabulary.cannot_see(name) for name in objects}
    unknown = [name for name, reason in reasons.items() if reason is not None]
    for name in unknown:
        print(f"ippon: {reasons[name]}", file=sys.stderr)
    return lambda frame, labels: detector.detect(frame.color, labels, None), unknown


def _print(name: str, finds: list[RecognisedFind], *, as_json: bool) -> None:
    if as_json:
        print(json.dumps({"object": name, "finds": [find.as_dict() for find in finds]}))
        return
    print(f"{name}: {len(finds) or 'none'}")
    for find in finds:
        x, y, z = find.position_world
        print(
            f"  p {find.probability:.2f} at ({x:.2f}, {y:.2f}, {z:.2f}) m, {find.size_m:.2f} m "
            f"long, in {find.images} images"
        )
