"""The parts of the project whose tests are measured, with the tests of each module."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Target:
    """A module that is changed."""

    module: str
    tests: tuple[str, ...]
    """Test files, or single tests, that have to notice."""
    has_kernels: bool = False
    """Kernels run uncompiled: numba's cache would return the kernel as it was before the change."""

    @property
    def path(self) -> str:
        """Return the module's file in the project."""
        return self.module.replace(".", "/") + ".py"


def _of(module: str, *, has_kernels: bool = False) -> Target:
    """Return a module with the test file at its own place."""
    folder, _, name = module.replace(".", "/").rpartition("/")
    return Target(module, (f"tests/{folder}/test_{name}.py",), has_kernels)


_OBJECTS = "ippon.mapping.objects"
_UPDATE: Final = "tests/ippon/mapping/objects/test_bayes_update.py"
_SMALL: Final = (
    "test_codes_and_tables",
    "test_every_label_and_the_object_are_equally_likely_before_any_image",
    "test_the_exponential_is_exact_to_a_millionth",
    "test_the_object_is_neither_floor_nor_too_high",
    "test_the_code_of_the_object_rises_with_its_log_odds",
)
"""The tests of the arithmetic that take no whole map, which is slow uncompiled."""
_ARITHMETIC: Final = tuple(
    f"tests/ippon/mapping/objects/test_posterior_arithmetic.py::{name}" for name in _SMALL
)
_POOLING: Final = (
    "tests/ippon/mapping/objects/test_place_pooling.py::"
    "test_energies_are_exact_to_a_thousandth_of_a_step"
)
_NAVIGATOR = "app.nodes.navigator"

PARTS: Final[dict[str, tuple[Target, ...]]] = {
    "metrics": (
        _of("ippon.evaluation.metrics"),
        _of("ippon.evaluation.statistics"),
        _of("ippon.evaluation.outcome"),
    ),
    "gain": (_of("ippon.planning.visibility.viewpoint_gain", has_kernels=True),),
    "filter": (
        _of(f"{_OBJECTS}.bayes_update", has_kernels=True),
        Target(f"{_OBJECTS}.posterior_arithmetic", (*_ARITHMETIC, _UPDATE), has_kernels=True),
        Target(f"{_OBJECTS}.place_pooling", (_POOLING, _UPDATE), has_kernels=True),
        _of(f"{_OBJECTS}.posterior_batch", has_kernels=True),
    ),
    "observation_model": (
        _of("ippon.observation_model"),
        _of(f"{_OBJECTS}.likelihood_tables"),
    ),
    "safety": (
        _of("ippon.control.safety_filter"),
        _of("ippon.control.acceleration_limits"),
        _of("ippon.control.obstacles", has_kernels=True),
    ),
    "lease": (
        _of(f"{_NAVIGATOR}.state.lease"),
        _of(f"{_NAVIGATOR}.services.lease_service"),
    ),
}
