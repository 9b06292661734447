"""`ippon profile`: what it prints, and what others do with the file."""

import pytest
from PIL import Image

from app.cli.main import run
from app.robot_file import read_profile


def test_a_file_to_start_from(capsys, tmp_path):
    assert run(["profile"]) == 0
    path = tmp_path / "mine.yaml"
    path.write_text(capsys.readouterr().out, "utf-8")
    assert read_profile(str(path)).name == "zed"


def test_a_file_is_checked_and_drawn(capsys, tmp_path):
    assert run(["profile", "habitat"]) == 0
    path, picture = tmp_path / "mine.yaml", tmp_path / "mine.png"
    path.write_text(capsys.readouterr().out.replace("name: habitat", "name: mine"), "utf-8")
    assert run(["profile", str(path), "--picture", str(picture)]) == 0
    out = capsys.readouterr().out
    assert out.startswith("mine\n")
    assert "0.34 m" in out
    assert "must not reverse" in out
    assert "0.5 to 5 m" in out
    with Image.open(picture) as image:
        colours = image.convert("RGB").getcolors(1 << 24)
    assert colours is not None
    assert len(colours) > 5


@pytest.mark.parametrize(
    "arguments",
    [
        ["profile", "nosuch.yaml"],
        ["navigate", "--profile", "nosuch.yaml"],
        ["sim", "--profile", "nosuch.yaml"],
        ["demo", "--profile", "nosuch.yaml"],
    ],
)
def test_no_such_profile(arguments, capsys):
    assert run(arguments) == 2
    error = capsys.readouterr().err
    assert "give zed, habitat, anymal-zedx" in error
    assert "or a YAML file; `ippon profile` prints one to start from" in error


def test_a_body_far_behind_its_camera_is_drawn_whole(capsys, tmp_path):
    assert run(["profile"]) == 0
    text = capsys.readouterr().out.replace("forward_m: 0 ", "forward_m: -1.5 ")
    path, picture = tmp_path / "mine.yaml", tmp_path / "mine.png"
    path.write_text(text.replace("max_depth_m: 5", "max_depth_m: 0.4"), "utf-8")
    assert run(["profile", str(path), "--picture", str(picture)]) == 0
    assert picture.is_file()
    assert "no floor within its range" in capsys.readouterr().out


def test_a_picture_that_cannot_be_written(capsys):
    assert run(["profile", "--picture", "/nosuch/robot.png"]) == 2
    assert "cannot write the picture" in capsys.readouterr().err
