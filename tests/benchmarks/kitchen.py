"""Finds of a real detector in the recorded kitchen, of its images in several parts and orders.

A find is right within reach of a known object of its kind, and wrong where its kind is absent or
all of its kind are known. Tables of what a score is worth are the default and those fitted to one
half of the images.
"""

import itertools
import random
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from app.recognition.calibration import CalibrationRecording, calibrate, read_known_objects
from app.recognition.frames import FrameSource, open_source
from app.recognition.recognition import Recognition, in_own_world
from ippon.calibration.known_objects import KnownObjects
from ippon.frame import Frame
from ippon.geometry import Float64Array
from ippon.observation import Detections
from ippon.observation_model import ObservationModel, ObservationModels
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.detectors.detector import Detector
from ippon.vocabulary import MATTERPORT_40
from tests.benchmarks.detector_errors import KITCHEN, MODEL, NEAR_M
from tests.benchmarks.rows import Row
from tests.locations import SHARED

VOXEL_M: Final = 0.05
LIKE_LEAFLETS: Final = "bottle"
"""Asked for as well, because leaflets look like it."""

Seen = tuple[Frame, Detections]


def kitchen_rows() -> Iterator[Row]:
    """Recognise objects in all images, in parts of them, and in other orders."""
    if not KITCHEN.is_dir() or not MODEL.exists():
        sys.stderr.write(f"left out: the kitchen or the detector is not in {SHARED}\n")
        return
    source, known = open_source(KITCHEN), read_known_objects(KITCHEN / "objects.json")
    kinds = (*known.labels, LIKE_LEAFLETS)
    config = SegmentationConfig(backend="detector", model=str(MODEL), threads=1)
    detector = Detector(config, SHARED)
    labels = tuple(dict.fromkeys((*MATTERPORT_40, *kinds)))
    seen: list[Seen] = []
    times: list[float] = []
    for frame in source.frames():
        began = time.process_time()
        said = detector.segment(frame.color, labels, None)
        times.append(1e3 * (time.process_time() - began))
        assert isinstance(said, Detections), "a detector gives boxes"
        seen.append((frame, said))
    yield Row(name="detector, one image", data="redkitchen", median_ms=float(np.median(times)))
    shuffled = list(seen)
    random.Random(0).shuffle(shuffled)
    even, odd = seen[::2], seen[1::2]
    told = [name for name in kinds if detector.vocabulary.label_for(name, labels) is not None]
    of_even, of_odd = (_fitted(source, known, part, told, len(labels)) for part in (even, odd))
    half = len(seen) // 2
    for name, images, model in (
        ("all images", seen, None),
        ("even images", even, None),
        ("odd images", odd, None),
        ("odd images, table fitted to the even ones", odd, of_even),
        ("even images, table fitted to the odd ones", even, of_odd),
        ("all images, last first", seen[::-1], None),
        ("all images, shuffled", shuffled, None),
        (f"first {half} images", seen[:half], None),
        (f"last {half} images", seen[half:], None),
    ):
        yield from _rows(name, images, model, source.T_map_world, known, told)


@dataclass(frozen=True)
class _Part:
    """Some images of a recording, as a source of frames."""

    path: Path
    T_map_world: Float64Array
    part: Sequence[Seen]

    def frames(self) -> Iterator[Frame]:
        return (frame for frame, _ in self.part)


def _fitted(
    source: FrameSource, known: KnownObjects, part: Sequence[Seen], told: Sequence[str], labels: int
) -> ObservationModel:
    images: Any = _Part(source.path, source.T_map_world, part)
    names = [name for name in known.labels if name in told]
    recording = CalibrationRecording(images, known, names, VOXEL_M)
    said = itertools.chain(one for _, one in part)
    recording.read(lambda _: next(said), lambda _: None)
    return calibrate([recording], labels).model


def _rows(
    name: str,
    images: Sequence[Seen],
    model: ObservationModel | None,
    T_map_world: Float64Array,
    known: KnownObjects,
    kinds: Sequence[str],
) -> Iterator[Row]:
    models = ObservationModels([] if model is None else [model])
    recognition = Recognition(kinds, models, voxel_size_m=VOXEL_M)
    for frame, said in images:
        recognition.add(frame, said)
    right = wrong = 0
    for kind in kinds:
        places = [o.centre_world for o in known.objects if o.label == kind]
        unclear = [o.centre_world for o in known.unclear if o.label == kind]
        found = [
            np.array(find.position_world)
            for find in in_own_world(recognition, kind, T_map_world)
        ]  # fmt: skip
        hit = sum(any(_is_near(one, place, kind) for one in found) for place in places)
        right += hit
        if places:
            data = f"redkitchen, {len(places)} known"
            yield Row(name=f"{name}: {kind} found", data=data, value=hit)
        if known.is_complete(kind):
            there = (*places, *unclear)
            wrong += sum(not any(_is_near(one, place, kind) for place in there) for one in found)
    data = f"redkitchen, {len(known.objects)} known"
    yield Row(name=f"{name}: all found", data=data, value=right)
    yield Row(name=f"{name}: wrong finds", data="redkitchen", value=wrong)


def _is_near(find: Float64Array, place: tuple[float, float, float], kind: str) -> bool:
    return float(np.linalg.norm(find - np.array(place))) <= NEAR_M[kind]
