"""Compiling ahead uses every kernel."""

import os
import subprocess
import sys
import time

import pytest

from ippon.compiling import compile_beside
from ippon.mapping.warm_up import warm_up

STEPS = ["geometry", "object probabilities", "object layers", "queries", "surface"]


@pytest.mark.parametrize("beside", [False, True])
def test_every_step_is_named(beside):
    assert list(warm_up(beside=beside)) == STEPS


def test_the_process_beside_compiles_what_a_map_uses():
    # In a process of its own: what is compiled stays compiled in this one.
    code = (
        "from ippon.mapping.warm_up import warm_up, warm_up_objects\n"
        "from ippon.mapping.surface_update import fuse_kernel\n"
        "warm_up_objects()\n"
        "before = set(fuse_kernel.overloads)\n"
        "list(warm_up())\n"
        "print(len(before), set(fuse_kernel.overloads) == before)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    assert done.stdout.split() == ["1", "True"]


def test_the_block_waits_for_the_process_beside():
    start = time.monotonic()
    with compile_beside("tests.mapping.test_warm_up", "take_a_second"):
        pass
    assert time.monotonic() - start > 1.0


def test_an_error_in_the_block_does_not_wait():
    start = time.monotonic()
    with (
        pytest.raises(KeyError),
        compile_beside("tests.mapping.test_warm_up", "take_a_minute"),
    ):
        raise KeyError
    assert time.monotonic() - start < 20.0


def test_a_process_beside_that_fails_is_no_error():
    with compile_beside("tests.mapping.test_warm_up", "fail"):
        pass


def take_a_second() -> None:
    time.sleep(1.0)


def take_a_minute() -> None:
    time.sleep(60.0)


def fail() -> None:
    os._exit(3)
