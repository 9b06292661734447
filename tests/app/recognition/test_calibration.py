"""`ippon calibrate` on real images, and on what nothing can be fitted to."""

import json
import subprocess
import sys

import pytest

from app.cli.main import run
from app.cli.tools.calibrate import _known_beside, _told
from app.errors import UsageError
from ippon.observation_model import read_observation_model
from ippon.segmentation.detectors.coco import COCO_80
from ippon.segmentation.detectors.vocabulary import ClosedVocabulary
from tests.app.recognition.test_recognition import MODEL, SEQUENCE, every_nth_image
from tests.locations import ROOT


def calibrate(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "app", "calibrate", *map(str, arguments)],
        cwd=ROOT, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.skipif(not (SEQUENCE.exists() and MODEL.exists()), reason="needs the shared images")
def test_a_table_fitted_to_half_of_a_real_kitchen_explains_the_other_half_better(tmp_path):
    pytest.importorskip("ncnn")
    out = tmp_path / "table.json"
    ran = calibrate(
        every_nth_image(tmp_path, 4), "--out", out,
        "--segmentation.backend", "detector", "--segmentation.model", MODEL,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    assert "no better" not in ran.stderr
    assert "second half" in ran.stdout
    model = read_observation_model(out)
    assert model.source == "nanodet-plus-m_416"
    assert model.kind == "scores"
    table = model.table
    assert table.nats[-1] > 5.0 > table.nats[1] < 0.0 > table.not_recognised
    assert "2 cup" in model.provenance


@pytest.mark.slow
@pytest.mark.parametrize(
    ("known", "text"),
    [
        (None, "cannot read"),
        ("{", "cannot read"),
        ("[]", "known objects are"),
        (json.dumps({"objects": [{"label": "cup"}]}), "'centre_world' is missing"),
    ],
)
@pytest.mark.skipif(not SEQUENCE.exists(), reason="needs the shared images")
def test_known_objects_that_cannot_be_read(tmp_path, capsys, known, text):
    file = tmp_path / "objects.json"
    if known is not None:
        file.write_text(known)
    out = tmp_path / "table.json"
    assert run(["calibrate", str(SEQUENCE), "--known", str(file), "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert text in said
    assert "objects.json" in said


def test_a_folder_that_is_not_there(tmp_path, capsys):
    assert run(["calibrate", str(tmp_path), "--out", str(tmp_path / "none/table.json")]) == 2
    assert "does not exist" in capsys.readouterr().err


def test_known_objects_lie_in_the_folder_of_a_recording(tmp_path):
    bag = tmp_path / "a.mcap"
    bag.write_bytes(b"")
    with pytest.raises(UsageError, match=r"there is no .*/objects.json: list the objects"):
        _known_beside(bag)
    (tmp_path / "objects.json").write_text("{}")
    assert _known_beside(bag) == _known_beside(tmp_path) == tmp_path / "objects.json"


def test_a_known_object_of_another_name_is_said_with_the_name_to_use(capsys):
    class Network:
        vocabulary = ClosedVocabulary.of(COCO_80)

    names = ("cup", "monitor", "unicorn")
    assert _told(Network(), names) == ["cup"]
    assert capsys.readouterr().err == (
        "ippon: this network cannot recognise unicorn: not used\n"
        "ippon: this network's label for monitor is tv: not used, list it as tv\n"
    )
