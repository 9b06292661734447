import datetime as dt

import pytest

from app.certificates.authority import issue, open_authority
from app.certificates.own_role import role_mismatch
from app.certificates.roles import write_roles
from app.cli.main import run
from app.links.network.session import PROFILE


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder, now = tmp_path_factory.mktemp("tls"), dt.datetime.now(dt.UTC)
    write_roles(folder, robots=("ippon",), hosts=("localhost",), days=2, now=now)
    pem, _ = issue(open_authority(folder, now), "scout-7", ("localhost",), 2, now)
    (folder / "scout.pem").write_bytes(pem)
    own = (folder / "robot.json5").read_text().replace("robot.pem", "scout.pem")
    (folder / "scout.json5").write_text(own)
    (folder / "broken.json5").write_text(own.replace("scout.pem", "ca.key"))
    (folder / "plain.json5").write_text("{}")
    return folder


@pytest.mark.parametrize(
    ("name", "accepted", "is_wrong"),
    [
        ("console", ("robot",), True),
        ("robot", ("robot",), False),
        ("console", ("requester", "console"), False),
        ("robot", ("navigator",), True),
        ("navigator", ("robot",), False),
        ("scout", ("console",), False),
        ("plain", ("robot",), False),
        ("broken", ("robot",), False),
        ("missing", ("robot",), False),
    ],
)
def test_the_certificate_of_another_role_is_said(folder, monkeypatch, name, accepted, is_wrong):
    monkeypatch.setenv(PROFILE, str(folder / f"{name}.json5"))
    assert (f"a certificate of the role {name!r}" in role_mismatch(accepted)) == is_wrong
    monkeypatch.delenv(PROFILE)
    assert role_mismatch(accepted) == ""


@pytest.mark.parametrize(
    ("role", "arguments"),
    [("recorder", ["ask", "hat", "--timeout-s", "0.1"]), ("console", ["replay", "nothing"])],
)
def test_a_command_says_it_before_it_waits(folder, monkeypatch, capsys, role, arguments):
    _check_said(folder, monkeypatch, capsys, role, [*arguments, "--robot", "r"])


@pytest.mark.parametrize(
    "arguments", [["doctor", "--robot", "r"], ["profile", "--from-robot", "r"]]
)
def test_a_check_of_a_robot_says_it(folder, monkeypatch, capsys, arguments):
    _check_said(folder, monkeypatch, capsys, "robot", arguments)


def test_a_command_that_connects_to_no_robot_says_nothing(folder, monkeypatch, capsys):
    monkeypatch.setenv(PROFILE, str(folder / "robot.json5"))
    assert run(["profile"]) == 0
    assert capsys.readouterr().err == ""


def _check_said(folder, monkeypatch, capsys, role, arguments):
    monkeypatch.setenv(PROFILE, str(folder / f"{role}.json5"))
    assert run([*arguments, "--connect", "tls/127.0.0.1:1"]) != 0
    first = capsys.readouterr().err.splitlines()[0]
    assert f"a certificate of the role {role!r}; this needs '" in first
    assert "the navigator drops what this process sends" in first
