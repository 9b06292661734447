"""What a loaded network is, whichever library runs it."""

from collections.abc import Mapping
from typing import Any, Protocol

from numpy.typing import NDArray

Tensors = Mapping[str, NDArray[Any]]
"""Arrays by the names of a network's inputs or outputs."""
Shape = tuple[int | None, ...]
"""Sizes of a tensor; None where the file leaves one open."""


class Network(Protocol):
    """A network of one image at a time."""

    @property
    def inputs(self) -> Mapping[str, Shape]:
        """Shapes by name; empty where the file says none."""
        ...

    @property
    def notes(self) -> Mapping[str, str]:
        """What the file says of itself."""
        ...

    def run(self, inputs: Tensors) -> dict[str, NDArray[Any]]:
        """Compute the outputs.

        Args:
            inputs: Each with its batch of one.

        Raises:
            SegmentationError: The network failed.
        """
        ...
