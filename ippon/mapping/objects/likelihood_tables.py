"""Observation models as arrays for the kernels."""

import numpy as np
from numpy.typing import NDArray

from ippon.mapping.objects.posterior_arithmetic import NONE
from ippon.observation import Heatmap
from ippon.observation_model import ObservationModels

_Tables = tuple[NDArray[np.float32], NDArray[np.int64]]


class LikelihoodTables:
    """Converts observation models to arrays and caches them."""

    def __init__(self, models: ObservationModels) -> None:
        self._models = models
        self._made: dict[tuple[str, str, tuple[str, ...], str | None], _Tables] = {}

    def of(self, heatmap: Heatmap | None, labels: tuple[str, ...], ooi: str | None) -> _Tables:
        """Return the likelihood ratio of each value of a heatmap.

        Args:
            heatmap: The heatmap, or None.
            labels: Common labels of the map.
            ooi: Its object of interest.

        Returns:
            (T, 256) float32 likelihood ratios, and (N + 1,) the row of each label and of the
            object of interest.
        """
        if heatmap is None:
            return np.ones((1, 256), np.float32), np.zeros(len(labels) + 1, np.int64)
        key = (heatmap.source, heatmap.kind, labels, ooi)
        if key not in self._made:
            self._made[key] = self._make(heatmap, labels, ooi)
        return self._made[key]

    def _make(self, heatmap: Heatmap, labels: tuple[str, ...], ooi: str | None) -> _Tables:
        model = self._models.of(heatmap)
        tables = [model.table]
        rows = np.zeros(len(labels) + 1, np.int64)
        for k, label in enumerate((*labels, ooi)):
            table = None if label is None else model.labels.get(label)
            if table is not None:
                rows[k] = len(tables)
                tables.append(table)
        return np.exp(np.stack([one.log_ratios(heatmap.kind) for one in tables])), rows


def channel_of(heatmap: Heatmap, label: str) -> int:
    """Return the channel of a label or of the object of interest, `NONE` without one."""
    channel = heatmap.channel_of(label)
    return NONE if channel is None else channel
