"""Observation model of a network: log-likelihood ratio of a score.

A score s of a label gives log p(s | label) / p(s | another label) nats, from a monotone table of
the network, or of the label if it has its own table. `ippon calibrate` fits tables; those beside
this module are cautious defaults that state their origin.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from ippon.errors import IpponError
from ippon.observation import Heatmap, HeatmapKind
from ippon.vocabulary import canonical_label

NOT_RECOGNISED: Final = 0
"""Heatmap value of a label that was searched for and not recognised in good view."""
NOTHING_SAID: Final = 1
"""Heatmap value without information on a label: too far, at the image border, or covered."""
LEAST_SCORE: Final = 2
"""First heatmap value that stands for a score."""
MOST_NATS: Final = 12.0
"""Upper bound of the absolute log-likelihood ratio of a score."""
_FOLDER: Final = "observation_models"


class ObservationModelError(IpponError):
    """A file is not an observation model; the message gives the reason."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ScoreTable:
    """Log-likelihood ratio by score: linear between knots, constant beyond them.

    For a distribution it is linear in the logarithm of the probability.
    """

    scores: tuple[float, ...]
    """Scores of the knots, increasing, 0 to 1."""
    nats: tuple[float, ...]
    """Log-likelihood ratio at each knot, non-decreasing."""
    not_recognised: float = 0.0
    """Log-likelihood ratio, at most 0, of a label that was not recognised in good view; only for
    networks with separate scores per label."""

    def __post_init__(self) -> None:
        """Reject tables that are not monotone."""
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
    """Score tables of one network."""

    source: str
    """Name of the network, as in `Heatmap.source`."""
    kind: HeatmapKind
    table: ScoreTable
    """Table of labels without their own."""
    labels: Mapping[str, ScoreTable] = field(default_factory=dict[str, ScoreTable])
    """Tables of single labels."""
    provenance: str
    """Data that the tables were fitted to, or the reason for their values."""
    note: str = ""
    """What was changed in the tables of a file, empty for nothing."""

    def table_of(self, label: str) -> ScoreTable:
        """Return the table of a label."""
        return self.labels.get(label, self.table)

    def as_dict(self) -> dict[str, Any]:
        """Return the model in the form that `parse` reads."""
        return {
            "source": self.source,
            "kind": self.kind,
            "provenance": self.provenance,
            "table": _table_dict(self.table),
            "labels": {label: _table_dict(table) for label, table in self.labels.items()},
        }

    def check_network(self, source: str, kind: HeatmapKind) -> None:
        """Refuse a network that the model is not of: its scores would be weighed by another model.

        Args:
            source: Name of the network.
            kind: What it gives.

        Raises:
            ObservationModelError: It is another network.
        """
        if self.kind != kind or self.source not in (source, f"any {kind}"):
            raise ObservationModelError(
                f"the observation model is that of {self.source!r} ({self.kind}), and the network "
                f"is {source!r} ({kind}): its scores are not weighed by it. If it is the same "
                "network, correct `source` in the file; else run `ippon calibrate` with this one"
            )

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
                labels=_tables(content.get("labels", {})),
            )
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            what = f"{error} is missing" if isinstance(error, KeyError) else str(error)
            raise ObservationModelError(f"not an observation model: {what}") from error


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


def _tables(content: Mapping[str, Any]) -> dict[str, ScoreTable]:
    tables = {canonical_label(str(label)): _table(one) for label, one in content.items()}
    if len(tables) < len(content):
        raise ValueError(f"two of the labels are the same: {', '.join(content)}")
    return tables


def read_observation_model(path: Path) -> ObservationModel:
    """Read a file of `ippon calibrate`.

    Files of its earlier versions may have tables in which a weak score tells more against an object
    than that it was not recognised at all. These scores are raised to that, and `note` says so.

    Raises:
        ObservationModelError: The file cannot be read, or is not an observation model.
    """
    try:
        content = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise ObservationModelError(f"cannot read {path}: {error}") from error
    return _risen(ObservationModel.parse(content), content, path.name)


def _risen(model: ObservationModel, content: Mapping[str, Any], name: str) -> ObservationModel:
    """Return a model whose tables do not fall from "not recognised" to the lowest score.

    Args:
        model: As it was parsed.
        content: The file. Tables without `not_recognised`, which are no fits, stay as they are.
        name: Of the file.
    """
    written = {canonical_label(label): one for label, one in content.get("labels", {}).items()}
    falling = [label for label, one in model.labels.items() if _falls(one, written[label])]
    common = _falls(model.table, content["table"])
    if model.kind != "scores" or not (falling or common):
        return model
    labels = {
        label: _raised(one) if label in falling else one for label, one in model.labels.items()
    }
    told = ", ".join([*falling, *(["other labels"] if common else [])])
    note = (
        f"{name}: a weak score of {told} told more against an object than that it was not "
        "recognised, as in tables of earlier versions: it counts as that now. Run `ippon "
        "calibrate` again"
    )
    table = _raised(model.table) if common else model.table
    return replace(model, table=table, labels=labels, note=note)


def _falls(table: ScoreTable, written: Mapping[str, Any]) -> bool:
    return "not_recognised" in written and table.nats[0] < table.not_recognised


def _raised(table: ScoreTable) -> ScoreTable:
    return replace(table, nats=tuple(max(n, table.not_recognised) for n in table.nats))


class ObservationModels:
    """Observation models of a map.

    A heatmap is read by the model of its source, or by the default of its kind.

    Args:
        own: Models that take precedence over the shipped ones.
    """

    def __init__(self, own: Iterable[ObservationModel] = ()) -> None:
        shipped = {model.source: model for model in shipped_models()}
        self._models = shipped | {model.source: model for model in own}

    def of(self, heatmap: Heatmap) -> ObservationModel:
        """Return the model of a heatmap's source and kind."""
        return self.of_source(heatmap.source, heatmap.kind)

    def of_source(self, source: str, kind: HeatmapKind) -> ObservationModel:
        """Return the model of a network, or the default of the kind."""
        model = self._models.get(source)
        if model is not None and model.kind == kind:
            return model
        return self._models[f"any {kind}"]


@cache
def shipped_models() -> tuple[ObservationModel, ...]:
    """Return the default models."""
    folder = resources.files("ippon") / _FOLDER
    return tuple(
        ObservationModel.parse(json.loads(file.read_text("utf-8")))
        for file in sorted(folder.iterdir(), key=lambda file: file.name)
        if file.name.endswith(".json")
    )
