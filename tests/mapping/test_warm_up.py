"""Compiling ahead uses every kernel."""

from ippon.mapping.warm_up import warm_up


def test_every_step_is_named():
    steps = list(warm_up())
    assert steps == ["geometry", "object probabilities", "object layers", "queries", "surface"]
