"""`ippon recognise` on real images through a trained detector."""

import json
import math
import subprocess
import sys

import pytest

from app.cli.main import run
from tests.locations import ROOT, SHARED

SEQUENCE = SHARED / "rgbd/redkitchen_a"
MODEL = SHARED / "models/nanodet_plus_m_416/nanodet-plus-m_416.param"
ABSENT = ("sofa", "bed", "toilet", "teddy_bear", "refrigerator", "backpack", "vase", "laptop")


def recognise(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "app", "recognise", *arguments],
        cwd=ROOT, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.skipif(not (SEQUENCE.exists() and MODEL.exists()), reason="needs the shared images")
def test_a_real_kitchen_holds_what_is_in_it_and_nothing_that_is_not(tmp_path):
    pytest.importorskip("ncnn")
    kinds = ("cup", "tv", "chair", "table", "book", "bottle", *ABSENT, "hat")
    ran = recognise(
        str(SEQUENCE), "--find", ",".join(kinds), "--json", "--page", str(tmp_path / "page.html"),
        "--segmentation.backend", "detector", "--segmentation.model", str(MODEL),
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    lines = [json.loads(line) for line in ran.stdout.splitlines()]
    assert [line["object"] for line in lines] == list(kinds)
    assert "'hat' is none of them" in ran.stderr
    finds = {line["object"]: [f["position_world"] for f in line["finds"]] for line in lines}
    page = (tmp_path / "page.html").read_text()
    assert page.count('class="find"') == sum(map(len, finds.values()))
    assert page.count("<figure>") > 20
    assert "this network does not recognise it" in page
    assert "together: p 0.9" in page
    truth = json.loads((SEQUENCE / "objects.json").read_text())["objects"]

    def near(kind, position, within_m):
        return [
            n for n, o in enumerate(truth)
            if o["label"] == kind and math.dist(o["centre_world"], position) < within_m
        ]  # fmt: skip

    assert all(near("cup", at, 0.3) for at in finds["cup"])
    assert len({n for at in finds["cup"] for n in near("cup", at, 0.3)}) == 2
    assert all(near("tv", at, 0.7) for at in finds["tv"])
    assert all(near("book", at, 0.3) for at in finds["book"])
    assert len(finds["tv"]) == len(finds["table"]) == len(finds["book"]) == 1
    assert all(near("chair", at, 0.45) for at in finds["chair"])
    assert len({n for at in finds["chair"] for n in near("chair", at, 0.45)}) == 4
    assert all(finds[kind] == [] for kind in (*ABSENT, "hat", "bottle"))


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("/nowhere", "--find", "cup"), "/nowhere does not exist"),
        ((str(ROOT / "docs"), "--find", "cup"), "is not a known dataset"),
        ((str(ROOT), "--find", " , "), "--find takes comma-separated objects"),
        (("/nowhere", "--find", "cup", "--page", "/nowhere/page.html"), "folder /nowhere does not"),
    ],
)
def test_what_cannot_be_recognised_says_why(arguments, text, capsys):
    assert run(["recognise", *arguments]) == 2
    assert text in capsys.readouterr().err
