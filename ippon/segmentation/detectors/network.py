"""Interface of a loaded network, independent of the library."""

from collections.abc import Mapping
from typing import Any, Final, Protocol

from numpy.typing import NDArray

LARGEST_SIDE_PX: Final = 8192
"""Largest side of an input; files that state a larger one would exhaust the memory."""

Tensors = Mapping[str, NDArray[Any]]
"""Arrays by the names of a network's inputs or outputs."""
Shape = tuple[int | None, ...]
"""Sizes of a tensor; None where the file leaves one open."""


class Network(Protocol):
    """A network of one image at a time."""

    @property
    def inputs(self) -> Mapping[str, Shape]:
        """Shapes by name; empty if the file states none."""
        ...

    @property
    def notes(self) -> Mapping[str, str]:
        """Metadata of the file."""
        ...

    def run(self, inputs: Tensors) -> dict[str, NDArray[Any]]:
        """Compute the outputs.

        Args:
            inputs: Arrays with a batch dimension of one.

        Raises:
            SegmentationError: The network failed.
        """
        ...
