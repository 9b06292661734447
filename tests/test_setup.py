"""`scripts/setup` on machines that lack something, each made of stubs."""

import os
import shutil
import subprocess
import sys

import pytest

from tests.browser import runs
from tests.locations import ROOT

PYTHON = """#!/bin/sh
case "$*" in
    *"playwright install --with-deps"*) echo "$*" >>"$MADE/log"; exit 1 ;;
    *"playwright install"*) echo "$*" >>"$MADE/log"; touch "$MADE/browser" ;;
    *"pip install"*ros-rclpy*eclipse-zenoh*) echo "pip install ROS 2" >>"$MADE/log" ;;
    *"pip install"*) echo "pip install" >>"$MADE/log" ;;
    *browser.py) test -e "$MADE/browser" ;;
esac
"""

READER = f"""#!/bin/sh
[ "$1" != - ] || exec {sys.executable} "$@"
"""
"""A Python that runs what it is given on standard input."""


def program(path, text):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)


@pytest.fixture
def checkout(tmp_path):
    """A checkout whose Python keeps a log of what it is asked to install."""
    root = tmp_path / "checkout"
    for name in (
        "scripts/setup", "tests/browser.py", "pyproject.toml", "constraints.txt",
        "app/ros2/pyproject.toml",
    ):  # fmt: skip
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, root / name)
    program(root / ".venv/bin/python", PYTHON)
    return root


@pytest.fixture
def setup(tmp_path):
    """Run a checkout's set-up as a user, and return what its Python was asked for."""
    made = tmp_path / "made"
    made.mkdir()

    def run(root, user, *arguments, apt="exit 100"):
        program(tmp_path / "bin/apt-get", f"#!/bin/sh\n{apt}\n")
        program(tmp_path / "bin/apt-cache", "#!/bin/sh\n")
        program(tmp_path / "bin/sudo", "#!/bin/sh\nexit 1\n")
        program(tmp_path / "bin/nvidia-smi", "#!/bin/sh\nexit 1\n")
        program(tmp_path / "bin/id", f"#!/bin/sh\necho {user}\n")
        path = f"{tmp_path / 'bin'}:{os.environ['PATH']}"
        done = subprocess.run(
            [root / "scripts/setup", *arguments],
            env={**os.environ, "PATH": path, "MADE": str(made)},
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
        )
        log = made / "log"
        asked = log.read_text().splitlines() if log.exists() else []
        log.unlink(missing_ok=True)
        return done, asked

    return run


def test_playwright_has_a_browser_where_apt_has_none(checkout, setup):
    done, asked = setup(checkout, 0, "--dev")
    assert done.returncode == 0, done.stderr
    assert asked == [
        "pip install",
        "-m playwright install --with-deps chromium",
        "-m playwright install chromium",
    ]


def test_only_root_is_asked_for_playwrights_system_packages(checkout, setup):
    done, asked = setup(checkout, 1000, "--dev")
    assert done.returncode == 0, done.stderr
    assert asked == ["pip install", "-m playwright install chromium"]


def test_a_package_that_is_a_stub_is_no_browser(checkout, setup):
    done, asked = setup(checkout, 0, "--dev", apt="exit 0")
    assert done.returncode == 0, done.stderr
    assert asked[-1] == "-m playwright install chromium"


def test_packages_are_installed_once_and_again_after_a_move(checkout, setup):
    assert setup(checkout, 0)[1] == ["pip install"]
    assert setup(checkout, 0)[1] == []
    moved = checkout.rename(checkout.with_name("moved"))
    assert setup(moved, 0)[1] == ["pip install"]


def test_options_that_do_not_exist_are_refused_and_help_lists_those_that_do(checkout, setup):
    for options in (("--detectr",), ("--detector", "--segmentation")):
        done, asked = setup(checkout, 0, *options)
        assert (done.returncode, asked) == (1, [])
    done, asked = setup(checkout, 0, "--help")
    assert (done.returncode, asked) == (0, [])
    assert "scripts/setup --detector" in done.stdout


def test_what_the_tests_need_includes_what_the_product_needs(checkout, setup):
    assert setup(checkout, 0, "--dev", apt="exit 0")[1][0] == "pip install"
    assert setup(checkout, 0)[1] == []


def test_a_browser_counts_only_if_it_runs(tmp_path):
    program(tmp_path / "stub", "#!/bin/sh\necho 'install the snap'\nexit 10\n")
    program(tmp_path / "real", "#!/bin/sh\necho 'Chromium 1'\n")
    assert not runs(str(tmp_path / "stub"))
    assert not runs(str(tmp_path / "nosuch"))
    assert runs(str(tmp_path / "real"))


def test_a_machine_without_gpu_gets_torch_without_cuda(checkout, setup):
    cuda = """#!/bin/sh
case "$*" in
    *"import torch"*) exit 1 ;;
    *--dry-run*) echo '"name": "nvidia-cublas"' ;;
    *"pip install"*) echo "$*" >>"$MADE/log" ;;
esac
"""
    program(checkout / ".venv/bin/python", cuda)
    torch, packages = setup(checkout, 0, "--segmentation")[1]
    assert "--index-url https://download.pytorch.org/whl/cpu torch==" in torch
    assert packages.endswith("[segmentation]")


def test_torch_comes_from_the_usual_registry_where_that_brings_no_cuda(checkout, setup):
    plain = """#!/bin/sh
case "$*" in
    *"import torch"*) exit 1 ;;
    *--dry-run*) echo '"name": "torch"' ;;
    *"pip install"*) echo "$*" >>"$MADE/log" ;;
esac
"""
    program(checkout / ".venv/bin/python", plain)
    torch, _ = setup(checkout, 0, "--segmentation")[1]
    assert "--index-url" not in torch


def test_ros2_has_an_environment_of_its_own_and_is_installed_once(checkout, setup):
    program(checkout / ".venv-ros2/bin/python", PYTHON)
    program(checkout.parent / "bin/python3", READER + "exit 0\n")
    assert setup(checkout, 1000, "--ros2")[1] == ["pip install ROS 2"]
    assert setup(checkout, 1000, "--ros2")[1] == []
    assert not (checkout / ".venv/.installed").exists()


def test_a_list_of_ros2_packages_that_cannot_be_read_installs_nothing(checkout, setup):
    program(checkout / ".venv-ros2/bin/python", PYTHON)
    program(checkout.parent / "bin/python3", READER + "exit 0\n")
    (checkout / "app/ros2/pyproject.toml").unlink()
    done, asked = setup(checkout, 1000, "--ros2")
    assert (done.returncode, asked) == (1, [])
    assert "the list of ROS 2's packages cannot be read" in done.stderr


def test_ros2_is_for_the_python_of_its_wheels_and_says_where_there_is_none(checkout, setup):
    made_by = """{reader}
case "$*" in
    *sys.version_info*) {is_it} ;;
    *"-m venv"*) echo "{name} $1 $2" >>"$MADE/log" ;;
    *--version*) echo "Python 3.13.1" ;;
esac
"""
    # Of version 3.13, however it is asked for it.
    newer = """case "$*" in *"3, 13"* | *3.13*) exit 0 ;; esac; exit 1"""
    program(checkout / ".venv-ros2/bin/python", PYTHON)
    folder = checkout.parent / "bin"
    program(folder / "python3", made_by.format(reader=READER, name="python3", is_it=newer))
    program(folder / "python3.11", made_by.format(reader=READER, name="python3.11", is_it="exit 0"))
    assert setup(checkout, 1000, "--ros2")[1] == ["python3.11 -m venv", "pip install ROS 2"]
    (checkout / ".venv-ros2/.installed").unlink()
    program(folder / "python3.11", made_by.format(reader=READER, name="python3.11", is_it="exit 1"))
    done, asked = setup(checkout, 1000, "--ros2")
    assert (done.returncode, asked) == (1, [])
    assert "Python 3.11 is needed; found: Python 3.13.1" in done.stderr
