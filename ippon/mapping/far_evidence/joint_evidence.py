"""Evidence for several objects of interest from beyond the map's range."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ippon.geometry import Float64Array
from ippon.mapping.far_evidence.far_evidence import FarEvidence


class EvidenceAhead(Protocol):
    """Evidence in the views of viewpoints; see `FarEvidence` for the methods."""

    @property
    def revision(self) -> int:
        """Number that grows whenever `ahead` or `cued` may return something else."""
        ...

    def ahead(
        self, xy: Float64Array, headings: Float64Array, reach_m: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Return (N, A) nat, the log-likelihood ratio of the object in each view."""
        ...

    def cued(
        self, xy: Float64Array, headings: Float64Array, reach_m: NDArray[np.float32]
    ) -> NDArray[np.bool_]:
        """Return (N, A) whether a view holds evidence of a common object near the object."""
        ...


class JointEvidence:
    """The strongest evidence for any of several objects in each view.

    Args:
        parts: Evidence for each object; at least one.
    """

    def __init__(self, parts: Sequence[FarEvidence]) -> None:
        if not parts:
            raise ValueError("joint evidence is of at least one object; got none")
        self._parts = tuple(parts)

    @property
    def revision(self) -> int:
        """See `EvidenceAhead`."""
        return sum(part.revision for part in self._parts)

    def ahead(
        self, xy: Float64Array, headings: Float64Array, reach_m: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """See `EvidenceAhead`; the maximum over the objects."""
        each = [part.ahead(xy, headings, reach_m) for part in self._parts]
        return np.maximum.reduce(each)

    def cued(
        self, xy: Float64Array, headings: Float64Array, reach_m: NDArray[np.float32]
    ) -> NDArray[np.bool_]:
        """See `EvidenceAhead`; of any of the objects."""
        each = [part.cued(xy, headings, reach_m) for part in self._parts]
        return np.logical_or.reduce(each)
