from types import SimpleNamespace

import pytest

from app.cli.main import run
from app.cli.tools import navigator_address
from app.cli.tools.navigator_address import find_navigator
from app.errors import UsageError


@pytest.fixture
def running(monkeypatch):
    there = [
        SimpleNamespace(robot=robot, endpoint=f"tcp/127.0.0.1:{port}")
        for robot, port in (("ippon/home-1", 7447), ("ippon/home-2", 7448))
    ]
    monkeypatch.setattr(navigator_address, "running_navigators", lambda: there)
    return there


def test_the_one_that_is_named_or_alone_is_taken(running):
    assert find_navigator(None, "ippon/home-2") == ("tcp/127.0.0.1:7448", "ippon/home-2")
    running.pop()
    assert find_navigator(None, None) == ("tcp/127.0.0.1:7447", "ippon/home-1")
    assert find_navigator("tcp/elsewhere:1", None) == ("tcp/elsewhere:1", "ippon")


def test_another_name_is_answered_with_those_that_run(running):
    with pytest.raises(UsageError, match=r"no navigator of home-1 .* there is ippon/home-1, ip"):
        find_navigator(None, "home-1")
    with pytest.raises(UsageError, match="several navigators run"):
        find_navigator(None, None)
    running.clear()
    with pytest.raises(UsageError, match="or it still prepares its first start"):
        find_navigator(None, None)


@pytest.mark.parametrize("command", [("ask", "hat"), ("control",), ("memory",)])
@pytest.mark.parametrize("seconds", ["-1", "0", "nan", "inf"])
def test_a_time_that_is_none_is_refused_before_anything_is_asked(command, seconds, capsys):
    assert run([*command, "--connect", "tcp/127.0.0.1:1", f"--timeout-s={seconds}"]) == 2
    assert "--timeout-s is a positive number of seconds; got" in capsys.readouterr().err


@pytest.mark.parametrize(
    "command",
    [
        ("ask", "hat", "--robot"),
        ("control", "--robot"),
        ("memory", "--robot"),
        ("doctor", "--robot"),
        ("profile", "--from-robot"),
    ],
)
def test_a_prefix_that_is_none_is_refused_before_anything_is_asked(command, capsys):
    assert run([*command, "ippon/", "--connect", "tcp/127.0.0.1:1"]) == 2
    assert "a robot's key prefix is letters, digits" in capsys.readouterr().err
