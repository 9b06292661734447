"""Options of segmentation networks, and what the commands say without one."""

from pathlib import Path

import pytest
import tyro

from app.cli.main import run
from app.cli.nodes import segment
from app.cli.nodes.segment import arguments_of
from app.cli.options.nodes import Segment
from app.cli.options.segmentation import NavigatorSegmentation


def test_options_reach_the_process_beside_the_navigator():
    options = NavigatorSegmentation(
        where="here",
        backend="clipseg",
        model="/models/some model",
        models=Path("/m"),
        device="cpu",
        compile=True,
        small_objects=False,
        longest_side_px=80,
    )
    read = tyro.cli(Segment, args=arguments_of(options)).segmentation
    for name in type(read).__dataclass_fields__:
        assert getattr(read, name) == getattr(options, name), name


def test_options_of_a_detector_reach_it_too():
    options = NavigatorSegmentation(
        backend="detector",
        model="/models/net.onnx",
        labels_file="/models/labels.txt",
        family="rf-detr",
        threads=3,
        input_px=320,
    )
    read = tyro.cli(Segment, args=arguments_of(options)).segmentation
    for name in type(read).__dataclass_fields__:
        assert getattr(read, name) == getattr(options, name), name


def test_without_weights_the_command_says_what_to_fetch(tmp_path, capsys):
    pytest.importorskip("torch", reason="the extra ippon[segmentation] is not installed")
    assert run(["segment", "--segmentation.models", str(tmp_path)]) == 2
    assert "put san_vit_b_16.pth (from https://" in (said := capsys.readouterr().err)
    assert str(tmp_path) in said


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--keep-labels", "0"], "1 to 512 labels of each pixel are sent; got 0"),
        (["--robot", "a b"], "a robot's key prefix is letters"),
        (["--segmentation.longest-side-px", "3"], "longest_side_px must be 8 to 2048; got 3"),
        (["--segmentation.threads", "-1"], "threads must be 0 (all) to 1024; got -1"),
        (["--segmentation.input-px", "9"], "input_px must be 0 (the usual) or 64 to 4096; got 9"),
        (["--segmentation.backend", "detector"], "the detector needs its file: --segmentation."),
    ],
)
def test_what_cannot_be_is_refused(arguments, text, capsys):
    assert run(["segment", *arguments]) == 2
    assert text in capsys.readouterr().err


@pytest.mark.parametrize(
    ("endpoint", "profile", "text"),
    [
        ("localhost:7447", "", "'localhost:7447' is not a zenoh endpoint, such as tcp/"),
        ("tcp/127.0.0.1:7447", "/nowhere.json5", "which is not a zenoh configuration"),
    ],
)
def test_an_invalid_endpoint_is_refused_before_the_network_is_loaded(
    endpoint, profile, text, capsys, monkeypatch
):
    monkeypatch.setenv("IPPON_ZENOH_PROFILE", profile)
    monkeypatch.setattr(segment, "segmenter_of", lambda _: pytest.fail("it was loaded"))
    assert run(["segment", "--connect", endpoint]) == 2
    assert text in capsys.readouterr().err
