"""Fits an observation model to recordings with known objects."""

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from app.recognition.frames import FrameSource
from ippon.calibration.evidence import Evidence, EvidenceCollector
from ippon.calibration.fit import Score, fit_table, score_of
from ippon.calibration.known_objects import KnownObjects, KnownObjectsError
from ippon.errors import IpponError
from ippon.frame import Frame
from ippon.mapping.config import MapConfig
from ippon.observation import Observation
from ippon.observation_model import ObservationModel, ObservationModels
from ippon.segmentation.instance_heatmap import as_heatmap, objects_apart

ENOUGH_OBJECTS: Final = 5
"""Number of known objects from which a label gets its own table."""

Observe = Callable[[Frame], Observation]


class CalibrationError(IpponError):
    """No table can be fitted; the text says why."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fold:
    """Test of a table on the part of the recordings that was held out of its fit."""

    held_out: str
    """Held-out part."""
    before: Score
    """Measures of the previous table."""
    fitted: Score


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibrated:
    """The fitted model with its measures on held-out data."""

    model: ObservationModel
    before: ObservationModel
    folds: tuple[Fold, ...]
    objects: dict[str, int]
    """Number of known objects seen, by label."""

    @property
    def helps(self) -> bool:
        """Whether the fit is better than the previous table on held-out data."""
        return sum(one.fitted.log_loss for one in self.folds) < sum(
            one.before.log_loss for one in self.folds
        )


class CalibrationRecording:
    """Output of a network on a recording with known objects.

    Args:
        source: The recording.
        known: Known objects, positions in the recording's world.
        labels: Labels of `known` that the network recognises.
        voxel_size_m: Edge length of a voxel.
    """

    def __init__(
        self, source: FrameSource, known: KnownObjects, labels: Sequence[str], voxel_size_m: float
    ) -> None:
        self.source = source
        self._known = known
        # As in a search for one of them.
        self._apart = objects_apart(labels)
        range_m = MapConfig().ooi_max_range_m
        self._collector = EvidenceCollector(labels, voxel_size_m, range_m)
        self.network = ""

    @property
    def name(self) -> str:
        """Name of its folder or file."""
        return self.source.path.name

    def read(self, observe: Observe, progress: Callable[[int], None]) -> None:
        """Run every frame through the network.

        Raises:
            DatasetError: The recording cannot be read.
            SegmentationError: The network failed.
            CalibrationError: The network gives no scores.
        """
        for n, frame in enumerate(self.source.frames(), 1):
            heatmap = as_heatmap(observe(frame), frame.depth, apart=self._apart)
            if heatmap.kind != "scores":
                raise CalibrationError(
                    f"{heatmap.source or 'this network'} gives probabilities that sum to 1, "
                    f"which need no calibration: only networks that score each label separately "
                    "(detector, sam3, grounding-dino, owlv2, clipseg) are calibrated"
                )
            self.network = heatmap.source
            self._collector.add(frame, heatmap)
            progress(n)

    def evidence(self) -> list[Evidence]:
        """Return the evidence of each label."""
        return self._collector.evidence(self._known, self.source.T_map_world)

    def halves(self) -> tuple[list[Evidence], list[Evidence]]:
        """Return the evidence of the first and the second half of the images."""
        middle = self._collector.frames // 2
        T_map_world = self.source.T_map_world
        first, second = (
            self._collector.evidence(self._known, T_map_world, part)
            for part in (slice(middle), slice(middle, None))
        )
        return first, second


def read_known_objects(path: Path) -> KnownObjects:
    """Read the known objects.

    Raises:
        KnownObjectsError: The file cannot be read or is invalid.
    """
    try:
        content = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise KnownObjectsError(f"cannot read {path}: {error}") from error
    try:
        return KnownObjects.parse(content)
    except KnownObjectsError as error:
        raise KnownObjectsError(f"{path}: {error}") from error


def calibrate(recordings: Sequence[CalibrationRecording], labels: int) -> Calibrated:
    """Fit a model to recordings.

    It is cross-validated over the recordings, or over the halves of a single one.

    Args:
        recordings: Recordings read with the same network.
        labels: Labels of the map, which set the prior.

    Raises:
        CalibrationError: None of the known objects was seen.
    """
    prior = -math.log(labels - 1)
    every = [one.evidence() for one in recordings]
    evidence = [part for parts in every for part in parts]
    objects: dict[str, int] = {}
    for one in evidence:
        objects[one.label] = objects.get(one.label, 0) + one.objects
    if not any(objects.values()):
        raise CalibrationError(
            "none of the known objects was seen within range: are their positions in the "
            "recording's world, in metres?"
        )
    source = recordings[0].network
    before = ObservationModels().of_source(source, "scores")
    pooled = fit_table(evidence, before.table, prior)
    own = {
        label: fit_table([one for one in evidence if one.label == label], pooled, prior)
        for label, n in objects.items()
        if n >= ENOUGH_OBJECTS
    }
    folds: list[Fold] = []
    for held_out, train, test in _folds(recordings, every):
        if not train or not test:
            continue
        table = fit_table(train, before.table, prior)
        folds.append(
            Fold(
                held_out=held_out,
                before=score_of(test, before.table, prior),
                fitted=score_of(test, table, prior),
            )
        )
    model = ObservationModel(
        source=source,
        kind="scores",
        table=pooled,
        labels=own,
        provenance=_provenance(recordings, objects, folds),
    )
    return Calibrated(model=model, before=before, folds=tuple(folds), objects=objects)


def _folds(
    recordings: Sequence[CalibrationRecording], every: list[list[Evidence]]
) -> list[tuple[str, list[Evidence], list[Evidence]]]:
    """Return the name of the held-out part, the training evidence and the test evidence."""
    if len(recordings) == 1:
        first, second = recordings[0].halves()
        return [("second half", first, second), ("first half", second, first)]
    return [
        (recordings[n].name, [part for k, one in enumerate(every) if k != n for part in one], parts)
        for n, parts in enumerate(every)
    ]


def _provenance(
    recordings: Sequence[CalibrationRecording], objects: dict[str, int], folds: Sequence[Fold]
) -> str:
    names = ", ".join(one.name for one in recordings)
    counts = ", ".join(f"{n} {label}" for label, n in sorted(objects.items()) if n)
    none = ", ".join(sorted(label for label, n in objects.items() if not n))
    tested = "; ".join(
        f"{one.held_out}: {one.fitted.log_loss:.1f}, before {one.before.log_loss:.1f}"
        for one in folds
    )
    return (
        f"Fitted by ippon calibrate to {names}: {counts}"
        + (f"; known to be absent or complete: {none}" if none else "")
        + f". Log loss on held-out data: {tested or 'not tested'}."
    )
