import subprocess
import sys

import pytest

from app.process import boot


@pytest.mark.skipif(not boot.BOOT_ID.exists(), reason="this system tells no boot")
def test_another_process_has_the_same_boot_and_a_later_time():
    code = "from app.process.boot import boot_time; print(*boot_time())"
    here, before_s = boot.boot_time()
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    number, at_s = out.stdout.split()
    assert number == here == boot.boot_id() != ""
    assert before_s <= float(at_s) <= boot.boot_time()[1]


@pytest.mark.parametrize("content", [None, b"\xff"])
def test_a_system_without_a_number_has_the_wall_clock(content, tmp_path, monkeypatch):
    path = tmp_path / "boot_id"
    if content is not None:
        path.write_bytes(content)
    monkeypatch.setattr(boot, "BOOT_ID", path)
    monkeypatch.setattr("time.time", lambda: 1.5e9)
    assert boot.boot_time() == ("", 1.5e9)
