"""Names and commands of the demo's processes."""

import os
import subprocess
import sys
import time

import pytest

from app.demo.processes import DemoProcesses, prefix_part
from app.messages.keys import check_prefix
from app.nodes.console.config import PASSWORD_VARIABLE, ConsoleConfig
from tests.ports import free_port


@pytest.mark.parametrize(
    ("name", "part"),
    [("home-3", "home-3"), ("Bob's flat", "Bob_s_flat"), ("café 3", "caf_3"), ("", "home")],
)
def test_any_folder_name_makes_a_key_prefix(name, part):
    assert prefix_part(name) == part
    check_prefix(f"ippon/{prefix_part(name)}-4194304")


def test_a_long_folder_name_makes_a_key_prefix():
    check_prefix(f"ippon/{prefix_part('x' * 255)}-4194304")


def test_the_page_needs_no_login_where_a_password_is_exported(monkeypatch):
    monkeypatch.setenv(PASSWORD_VARIABLE, "correct horse")
    started = []
    monkeypatch.setattr(subprocess, "Popen", lambda *_, env, **__: started.append(env))
    DemoProcesses("ippon/home-3-1", "tcp/127.0.0.1:7450").begin_console(8080)
    monkeypatch.setattr(os, "environ", started[0])
    assert not ConsoleConfig().has_login


@pytest.mark.process
def test_what_starts_the_console_again_is_a_command_that_works(tmp_path):
    port = free_port()
    processes = DemoProcesses("ippon/home-3-1", "tcp/127.0.0.1:7450", port)
    command = processes.console_command()
    assert command.startswith(sys.executable)
    assert f"--connect tcp/127.0.0.1:7450 --robot ippon/home-3-1 --port {port}" in command
    log = tmp_path / "log"
    with log.open("wb") as stream:
        child = subprocess.Popen(["bash", "-c", f"exec {command}"], cwd=tmp_path, stderr=stream)
    try:
        deadline = time.monotonic() + 60.0
        while f"console at http://127.0.0.1:{port}" not in log.read_text():
            assert child.poll() is None, log.read_text()
            assert time.monotonic() < deadline, log.read_text()
            time.sleep(0.05)
    finally:
        child.terminate()
        child.wait()
