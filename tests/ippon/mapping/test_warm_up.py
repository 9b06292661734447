"""Compiling ahead uses every kernel."""

import os
import subprocess
import sys
import time

import pytest

from ippon.compiling import compile_in_second_process
from ippon.mapping.warm_up import warm_up

STEPS = ["geometry", "object probabilities", "object layers", "surface"]


@pytest.mark.parametrize("beside", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_every_step_is_named(beside):
    assert list(warm_up(beside=beside)) == STEPS


def _printed_by(code):
    """Return what a process of its own prints: what is compiled here stays compiled."""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=120
    )
    return done.stdout


@pytest.mark.slow
def test_the_second_process_compiles_the_kernels_of_a_map():
    # In a process of its own: what is compiled stays compiled in this one.
    code = (
        "from ippon.mapping.warm_up import warm_up, warm_up_objects\n"
        "from ippon.mapping.objects.surface_fusion import fuse_kernel\n"
        "warm_up_objects()\n"
        "before = set(fuse_kernel.overloads)\n"
        "list(warm_up())\n"
        "print(len(before), set(fuse_kernel.overloads) == before)\n"
    )
    assert _printed_by(code).split() == ["1", "True"]


@pytest.mark.slow
def test_the_first_far_evidence_finds_its_kernels_compiled():
    # The planner's arrays, in a process of its own.
    code = (
        "import numpy as np\n"
        "from ippon.mapping.far_evidence import far_evidence as g\n"
        "from ippon.mapping.warm_up import _frame, warm_up_far_evidence\n"
        "from ippon.mapping.far_evidence import evidence_grid as e, image_columns as c\n"
        "kernels = [c._columns_kernel, e._integrate_kernel, e._spread_kernel, e._ahead_kernel]\n"
        "warm_up_far_evidence()\n"
        "before = [len(k.overloads) for k in kernels]\n"
        "far_evidence = g.FarEvidence(g.FarEvidenceConfig(), 'hat', 1.0, 20.0)\n"
        "far_evidence.integrate(_frame('hat'))\n"
        "reach = np.ones((9, 80), np.float32)[[1, 2]][:, ::2] * np.float32(0.1)\n"
        "far_evidence.ahead(np.ones((9, 2))[[1, 2]], np.linspace(0.0, 6.0, 40), reach)\n"
        "print(far_evidence.revision, before, [len(k.overloads) for k in kernels])\n"
    )
    assert _printed_by(code).strip() == "1 [1, 1, 1, 1] [1, 1, 1, 1]"


@pytest.mark.slow
def test_the_block_waits_for_the_process_beside():
    start = time.monotonic()
    with compile_in_second_process("tests.ippon.mapping.test_warm_up", "take_a_second"):
        pass
    assert time.monotonic() - start > 1.0


def test_an_error_in_the_block_does_not_wait():
    start = time.monotonic()
    with (
        pytest.raises(KeyError),
        compile_in_second_process("tests.ippon.mapping.test_warm_up", "take_a_minute"),
    ):
        raise KeyError
    assert time.monotonic() - start < 20.0


@pytest.mark.slow
def test_a_process_beside_that_fails_is_no_error():
    with compile_in_second_process("tests.ippon.mapping.test_warm_up", "fail"):
        pass


def take_a_second() -> None:
    time.sleep(1.0)


def take_a_minute() -> None:
    time.sleep(60.0)


def fail() -> None:
    os._exit(3)
