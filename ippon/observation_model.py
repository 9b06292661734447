"""How much a network's score says: the observation model between a source and the filter.

A score s of a label is worth log p(s | label) / p(s | another label) nats, read from a monotone
table of the network, and of the label where it has one of its own. Tables are fitted by
`ippon calibrate`; those that lie beside this module are cautious defaults, each with its origin.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ippon.errors import IpponError
from ippon.observation import Heatmap, HeatmapKind

NOT_RECOGNISED: Final = 0
"""Value of a heatmap of scores where a label was looked for, well in view, and not recognised."""
NOTHING_SAID: Final = 1
"""Value where nothing is known of a label: too far, at the border of the image, covered."""
LEAST_SCORE: Final = 2
"""Scores begin with this value."""
MOST_NATS: Final = 12.0
"""No score is worth more, for or against."""
_FOLDER: Final = "observation_models"


class ObservationModelError(IpponError):
    """A file is no observation model; the text says why."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ScoreTable:
    """The worth of a score: linear between knots, constant beyond them.

    For a distribution it is linear in the logarithm of the probability.
    """

    scores: tuple[float, ...]
    """Knots, rising, 0 to 1."""
    nats: tuple[float, ...]
    """Log-likelihood ratio at each knot; never falling."""
    not_recognised: float = 0.0
    """Log-likelihood ratio, at most 0, where a label in good view was not recognised; only for
    networks whose labels have scores of their own."""

    def __post_init__(self) -> None:
        """Refuse what is no monotone table."""
        scores, nats = np.array(self.scores), np.array(self.nats)
        if scores.ndim != 1 or scores.shape != nats.shape or len(scores) < 2:
            raise ValueError(
                f"a table has as many scores as nats, two at least; got {len(self.scores)} and "
                f"{len(self.nats)}"
            )
        if not (np.diff(scores) > 0.0).all() or scores[0] < 0.0 or scores[-1] > 1.0:
            raise ValueError(f"scores rise from knot to knot, within 0 to 1; got {self.scores}")
        if not (np.diff(nats) >= 0.0).all() or not (np.abs(nats) <= MOST_NATS).all():
            raise ValueError(
                f"nats never fall from knot to knot and lie within ±{MOST_NATS:g}; got {self.nats}"
            )
        if not -MOST_NATS <= self.not_recognised <= 0.0:
            raise ValueError(
                f"not_recognised is 0 or less, and at least {-MOST_NATS:g}; got "
                f"{self.not_recognised}"
            )

    def log_ratios(self, kind: HeatmapKind) -> NDArray[np.float32]:
        """Return (256,) float32, nats of each value of a heatmap of this kind."""
        values = np.arange(256) / 255.0
        if kind == "distribution":
            # Linear in the logarithm: two knots make the paper's rule, nats = log p.
            least = 1.0 / 255.0
            log_knots = np.log(np.maximum(self.scores, least))
            return np.interp(np.log(np.maximum(values, least)), log_knots, self.nats).astype(
                np.float32
            )
        values = np.interp(values, self.scores, self.nats)
        values[NOT_RECOGNISED], values[NOTHING_SAID] = self.not_recognised, 0.0
        return values.astype(np.float32)


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservationModel:
    """What the scores of one network are worth."""

    source: str
    """Name of the network, as `Heatmap.source` gives it."""
    kind: HeatmapKind
    table: ScoreTable
    """For labels without a table of their own."""
    labels: Mapping[str, ScoreTable] = field(default_factory=dict[str, ScoreTable])
    """Tables of single labels."""
    provenance: str
    """What the tables were fitted on, or why they are what they are."""

    def table_of(self, label: str) -> ScoreTable:
        """Return the table that applies to a label."""
        return self.labels.get(label, self.table)

    def as_dict(self) -> dict[str, Any]:
        """Return what `parse` reads."""
        return {
            "source": self.source,
            "kind": self.kind,
            "provenance": self.provenance,
            "table": _table_dict(self.table),
            "labels": {label: _table_dict(table) for label, table in self.labels.items()},
        }

    @classmethod
    def parse(cls, content: Mapping[str, Any]) -> "ObservationModel":
        """Read a model.

        Raises:
            ObservationModelError: A field is missing or of another type, or a table is not
                monotone.
        """
        try:
            return cls(
                source=str(content["source"]),
                kind=_kind(content["kind"]),
                provenance=str(content["provenance"]),
                table=_table(content["table"]),
                labels={str(k): _table(v) for k, v in content.get("labels", {}).items()},
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            what = f"{error} is missing" if isinstance(error, KeyError) else str(error)
            raise ObservationModelError(f"no observation model: {what}") from error


def _kind(text: object) -> HeatmapKind:
    if text == "scores":
        return "scores"
    if text == "distribution":
        return "distribution"
    raise ValueError(f"kind is scores or distribution; got {text!r}")


def _table_dict(table: ScoreTable) -> dict[str, Any]:
    return {
        "scores": list(table.scores),
        "nats": list(table.nats),
        "not_recognised": table.not_recognised,
    }


def _table(content: Mapping[str, Any]) -> ScoreTable:
    return ScoreTable(
        scores=tuple(float(s) for s in content["scores"]),
        nats=tuple(float(n) for n in content["nats"]),
        not_recognised=float(content.get("not_recognised", 0.0)),
    )


def read_observation_model(path: Path) -> ObservationModel:
    """Read a file that `ippon calibrate` wrote.

    Raises:
        ObservationModelError: It cannot be read, or is no observation model.
    """
    try:
        content = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise ObservationModelError(f"cannot read {path}: {error}") from error
    return ObservationModel.parse(content)


class ObservationModels:
    """The models that a map uses.

    A heatmap is read by the model of its source; where there is none, by the default of its kind.

    Args:
        own: Come before those that are shipped.
    """

    def __init__(self, own: Iterable[ObservationModel] = ()) -> None:
        shipped = {model.source: model for model in shipped_models()}
        self._models = shipped | {model.source: model for model in own}

    def of(self, heatmap: Heatmap) -> ObservationModel:
        """Return the model of a heatmap's source and kind."""
        return self.of_source(heatmap.source, heatmap.kind)

    def of_source(self, source: str, kind: HeatmapKind) -> ObservationModel:
        """Return the model of a network's heatmaps; the default of their kind where it has none."""
        model = self._models.get(source)
        if model is not None and model.kind == kind:
            return model
        return self._models[f"any {kind}"]


@cache
def shipped_models() -> tuple[ObservationModel, ...]:
    """Return the defaults."""
    folder = resources.files("ippon") / _FOLDER
    return tuple(
        ObservationModel.parse(json.loads(file.read_text("utf-8")))
        for file in sorted(folder.iterdir(), key=lambda file: file.name)
        if file.name.endswith(".json")
    )
