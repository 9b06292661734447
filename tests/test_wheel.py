"""The wheel: every file of the packages is in it, and nothing else."""

import subprocess
import sys
import zipfile

import pytest

from tests.locations import ROOT

pytest.importorskip("hatchling", reason="hatchling builds the wheel: scripts/setup --dev")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(build, cwd=ROOT, check=True, capture_output=True)
    with zipfile.ZipFile(next(folder.glob("*.whl"))) as opened:
        return {name: opened.read(name) for name in opened.namelist()}


@pytest.mark.slow
def test_every_file_of_the_packages_is_in_it(wheel):
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "app", "ippon",
         "web_assets"],
        cwd=ROOT, check=True, capture_output=True, text=True,
    ).stdout.split()  # fmt: skip
    here = {name for name in listed if (ROOT / name).is_file()}
    assert {name.rpartition(".")[2] for name in here} >= {
        "yaml",
        "msg",
        "js",
        "css",
        "html",
        "json",
    }
    inside = {name for name in wheel if ".dist-info/" not in name}
    assert here - inside == set()
    assert {name.partition("/")[0] for name in inside} == {"app", "ippon", "web_assets"}


@pytest.mark.slow
def test_it_has_the_command_and_names_its_extras(wheel):
    info = {name.rpartition("/")[2]: text.decode() for name, text in wheel.items()
            if ".dist-info/" in name}  # fmt: skip
    assert "ippon = app.__main__:main" in info["entry_points.txt"]
    for extra in ("segmentation", "detector", "ray", "foxglove", "rerun", "docs", "dev"):
        assert f"Provides-Extra: {extra}" in info["METADATA"]
