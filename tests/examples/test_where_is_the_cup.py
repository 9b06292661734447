"""The quick start: a recorded sequence is mapped, and the cups are where they are known to be."""

import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest

import ippon
from tests.app.recognition.test_recognition import MODEL, SEQUENCE, every_nth_image
from tests.locations import ROOT


@pytest.mark.slow
@pytest.mark.skipif(
    not (SEQUENCE.exists() and MODEL.exists()), reason="no recording and detector in ../shared"
)
def test_the_cups_of_the_kitchen_are_found(tmp_path):
    recording = every_nth_image(tmp_path, 4)
    done = subprocess.run(
        [sys.executable, "examples/where_is_the_cup.py", str(recording), str(MODEL)],
        cwd=ROOT, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True,
        check=True,
    )  # fmt: skip
    lines = done.stdout.splitlines()
    known = json.loads((SEQUENCE / "objects.json").read_text())
    cups = [one["centre_world"] for one in known["objects"] if one["label"] == "cup"]
    assert len(lines) == len(cups)
    for line in lines:
        at = [float(x) for x in re.findall(r"-?[0-9.]+(?=[,)])", line)]
        assert min(np.linalg.norm(np.array(cups) - at, axis=1)) < 0.2, line


def test_the_package_says_how_to_begin():
    text = ippon.__doc__
    code = "\n".join(line[4:] for line in text.splitlines() if line.startswith("    "))
    assert code.count("\n") <= 12
    imports = "\n".join(re.findall(r"^from .*$", code, re.MULTILINE))
    compile(code, "quick start", "exec")
    exec(imports, {})
    assert np.all([name in code for name in ("open_source", "load_segmenter", "in_own_world")])
