"""Steps of interrupted looks at each cluster, so that looks that take turns come to an end."""

from typing import Final

from ippon.geometry import Float64Array
from ippon.planning.selection.look_target import LookConfig, is_same_cluster

INTERRUPTED_FACTOR: Final = 2
"""How much longer all looks at one cluster may last that come to no end of their own: images that
miss it now and then, or another cluster that counts as the larger, interrupt each of them."""


class InterruptedLooks:
    """How long the interrupted looks at each cluster have lasted; none at first."""

    def __init__(self, config: LookConfig, kinds: int) -> None:
        """Begin without a look.

        Args:
            config: Which clusters are the same.
            kinds: How many kinds of steps are counted.
        """
        self._config = config
        self._kinds = kinds
        self._looks: list[tuple[Float64Array, tuple[int, ...]]] = []
        """Centre of each cluster, and its steps of each kind."""

    def clear(self) -> None:
        """Forget all looks."""
        self._looks.clear()

    def add(self, centre: Float64Array, *steps: int) -> None:
        """Keep the steps of each kind of a look at a cluster whose centre is (3,)."""
        self._looks.append((centre, steps))

    def take(self, centre: Float64Array) -> tuple[int, ...]:
        """Return the steps of each kind of all looks at a cluster, which are then forgotten."""
        total = (0,) * self._kinds
        others: list[tuple[Float64Array, tuple[int, ...]]] = []
        for old, steps in self._looks:
            if is_same_cluster(self._config, old, centre):
                total = tuple(a + b for a, b in zip(total, steps, strict=True))
            else:
                others.append((old, steps))
        self._looks = others
        return total
