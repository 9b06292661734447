"""The example packages of docs/examples: installed, and run by the program that finds them."""

import json
import os
import shutil
import subprocess
import sys

import pytest

from tests.app.recording.conftest import write_session
from tests.locations import ROOT

pytest.importorskip("hatchling", reason="hatchling builds the packages: scripts/setup --dev")
pytestmark = pytest.mark.slow

EXAMPLES = ROOT / "docs" / "examples"
MOST_LINES = 60


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Install every package in a folder of its own; returns a function that runs Python there."""
    sources, site = tmp_path_factory.mktemp("sources"), tmp_path_factory.mktemp("site")
    shutil.copytree(EXAMPLES, sources, dirs_exist_ok=True)
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index",
               "--no-build-isolation", "--target", str(site)]  # fmt: skip
    packages = [str(path.parent) for path in sources.glob("*/pyproject.toml")]
    subprocess.run([*install, *packages], check=True)
    more = [str(site), str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(more)}

    def run(*arguments):
        done = subprocess.run(
            [sys.executable, *arguments],
            env=environment,
            cwd=site,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr[-2000:]
        return done.stdout

    return run


def ask(run, code):
    return json.loads(run("-c", f"import json\n{code}").splitlines()[-1])


def test_packages_are_short():
    packages = sorted(path.parent for path in EXAMPLES.glob("*/pyproject.toml"))
    assert [path.name for path in packages] == [
        "detector", "exporter", "language_model", "method", "profile", "scenes", "segmentation",
    ]  # fmt: skip
    for package in packages:
        lines = [path.read_text().count("\n") for path in package.rglob("*.py")]
        assert sum(lines) < MOST_LINES, package


def test_a_method_and_a_source_of_scenes_are_evaluated_together(run, tmp_path):
    out = tmp_path / "results"
    method = "farthest_frontier@same_m=0.6"
    run("-m", "app", "eval", "run", "--methods", method, "--homes", "studio:6",
        "--objects", "plant", "--robot", "zed", "--image-width", "96", "--max-time-s", "60",
        "--workers", "1", "--out", str(out))  # fmt: skip
    (row,) = [json.loads(path.read_text()) for path in out.glob("rows/*.json")]
    assert (row["method"], row["home"], row["success"]) == (method, "studio:6", True)


def test_a_profile_is_found_by_name(run):
    assert "scout" in run("-m", "app", "profile", "scout")


def test_a_segmentation_and_a_detector_are_loaded(run):
    found = ask(
        run,
        """
import numpy as np
from pathlib import Path
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.loading import load_segmenter
image = np.full((64, 64, 3), 60, np.uint8)
image[:, :32] = (200, 20, 20)
image[20:40, 40:60] = 250
red, blobs = (
    load_segmenter(SegmentationConfig(backend="installed", model=name), Path("."))
    .segment(image, ("wall", "lamp"), "mug") for name in ("red", "blobs")
)
p = red.probabilities
print(json.dumps([int(p[2, 1, 2]), int(p[2, 6, 2]), [one.label for one in blobs.instances]]))
""",
    )
    assert found[0] > 240
    assert found[1] < 100
    assert found[2] == ["lamp"]


def test_a_language_model_rates_and_reads(run):
    found = ask(
        run,
        """
from app.cli.options.language_model import Llm
from app.cli.tools.language_model import make_model
from ippon.vocabulary import MATTERPORT_40
model = make_model(Llm(model="installed:grandmother"), {})
answer = model.levels("glasses", "", MATTERPORT_40, scenario="")
rows = {row.label: row for row in answer.guidance.rows}
reading = model.read_request("find my keys").request
print(json.dumps([answer.guidance.provider, rows["bed"].reason, len(reading.goals)]))
""",
    )
    assert found == ["grandmother", "it is always there", 1]


def test_an_export_is_written(run, tmp_path):
    folder = write_session(tmp_path).writer.folder
    run("-m", "app", "export", str(folder), "length")
    lines = (folder / "export" / "path-length.txt").read_text().splitlines()
    assert lines[0].startswith("0 ")
