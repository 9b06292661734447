"""The commands of the documents, and a shell in a network of its own that runs them."""

import contextlib
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Final, Self

import platformdirs

from tests.locations import ROOT

_LOOPBACK: Final = """
import fcntl, socket, struct, sys
fcntl.ioctl(socket.socket(), 0x8914, struct.pack("16sh", b"lo", 0x1 | 0x8 | 0x40))
print("up", flush=True)
sys.stdin.read()
"""
"""Sets the flags of the loopback interface (SIOCSIFFLAGS) and stays, so that the network does."""


def lines_of(document: Path) -> list[str]:
    """Return the lines of a document's blocks for the shell that run `ippon`, without comments."""
    blocks = re.findall(r"```(?:sh|bash)\n(.*?)```", document.read_text("utf-8"), re.DOTALL)
    lines = [line.strip() for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    plain = [re.sub(r"\s+", " ", re.sub(r"\s#\s.*", "", line)).strip() for line in lines]
    return [line for line in plain if re.match(r"(?:\w+=\S+ )?(?:ippon|scripts/demo) ", f"{line} ")]


class Running:
    """A command that runs."""

    def __init__(self, child: subprocess.Popen[bytes], said: Path, line: str) -> None:
        self._child, self._said, self._line = child, said, line

    def said(self) -> str:
        """Return standard output and error so far."""
        return self._said.read_text(errors="replace")

    def wait_for(self, text: str, timeout_s: float = 120.0) -> Self:
        """Wait until it says a text."""
        deadline = time.monotonic() + timeout_s
        while not re.search(text, self.said()):
            assert self._child.poll() is None, f"{self._line}: {self._child.poll()}\n{self.said()}"
            assert time.monotonic() < deadline, f"{self._line}: no {text!r} in\n{self.said()}"
            time.sleep(0.1)
        return self

    def finish(self, *, status: int = 0, timeout_s: float = 120.0) -> str:
        """Wait for the end, which must have this exit status; return what it said."""
        assert self._child.wait(timeout_s) == status, f"{self._line}\n{self.said()}"
        return self.said()

    def interrupt(self) -> None:
        """End it as Ctrl-C does."""
        os.killpg(self._child.pid, signal.SIGINT)
        status = self._child.wait(60.0)
        assert status in (0, 130, -signal.SIGINT), f"{self._line}: {status}\n{self.said()}"

    def kill(self) -> None:
        """End it, whatever it does."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self._child.pid, signal.SIGKILL)
        self._child.wait()


class DocumentShell:
    """Runs lines in a folder, with the usual ports free and no way to the internet."""

    def __init__(self, folder: Path) -> None:
        self.folder, self._started = folder, list[Running]()
        self.ran = set[tuple[str, str]]()
        """(document, line) that were run."""
        self._network = subprocess.Popen(
            ["unshare", "--user", "--map-root-user", "--net", sys.executable, "-c", _LOOPBACK],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        assert self._network.stdout is not None
        self.is_up = self._network.stdout.readline() == b"up\n"
        ours = folder / "home" / "ippon"
        ours.mkdir(parents=True)
        kernels = platformdirs.user_cache_path("ippon") / "kernels"
        kernels.mkdir(parents=True, exist_ok=True)
        (ours / "kernels").symlink_to(kernels)
        (folder / "bin").mkdir()
        for name, module in (("ippon", "-m app"), ("python", "")):
            file = folder / "bin" / name
            file.write_text(f'#!/bin/sh\nexec "{sys.executable}" -P {module} "$@"\n')
            file.chmod(0o755)

    def start(self, document: str, line: str, *, says: str = "", **instead: str) -> Running:
        """Start a line as it stands in a document.

        Args:
            document: Its path below `docs`.
            line: The line without its comment.
            says: What is typed while it runs.
            instead: Words of the line that stand for the reader's own, and what the reader means.
        """
        assert line in lines_of(ROOT / "docs" / document), f"{document} has no line {line!r}"
        self.ran.add((document, line))
        for word, meant in instead.items():
            assert word in line, f"no {word!r} in {line!r}"
            line = re.sub(rf"(?<!\w){re.escape(word)}(?!\w)", meant, line)
        return self.also(line, says=says)

    def run(self, document: str, line: str, *, says: str = "", **instead: str) -> str:
        """Run a line to its end, which must be without an error; return what it said."""
        return self.start(document, line, says=says, **instead).finish()

    def also(self, line: str, *, says: str = "") -> Running:
        """Start a line that stands in no document."""
        said = self.folder / f"said-{len(self._started)}.txt"
        home = str(self.folder / "home")
        with said.open("wb") as stream:
            child = subprocess.Popen(
                [
                    *("nsenter", f"--target={self._network.pid}", "--user", "--net"),
                    *("--preserve-credentials", "bash", "-c", line),
                ],
                cwd=self.folder,
                env={
                    **os.environ,
                    **dict.fromkeys(("HOME", "XDG_DATA_HOME", "XDG_CACHE_HOME"), home),
                    "PATH": f"{self.folder / 'bin'}{os.pathsep}{os.environ['PATH']}",
                    "PYTHONPATH": str(ROOT),
                },
                stdin=subprocess.PIPE,
                stdout=stream,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        assert child.stdin is not None
        child.stdin.write(says.encode())
        child.stdin.close()
        self._started.append(Running(child, said, line))
        return self._started[-1]

    def kill_all(self) -> None:
        """End every command that still runs, and free the ports."""
        for running in self._started:
            running.kill()

    def close(self) -> None:
        """End the network, too."""
        self.kill_all()
        self._network.kill()
        self._network.communicate()
