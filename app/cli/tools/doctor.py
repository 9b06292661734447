"""`ippon doctor`: what is installed, reachable and fast enough."""

import ctypes
import importlib.metadata
import json
import os
import platform
import shutil
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from app.cli.options.commands import Doctor
from app.cli.options.segmentation import Segmentation
from app.links.network.registry import running_navigators

Verdict = Literal["ok", "warning", "missing"]
COLORS: Final[dict[Verdict, str]] = {"ok": "green", "warning": "yellow", "missing": "red"}
LIBRARIES: Final = {
    "libusb-1.0.so.0": "libusb-1.0-0",
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libX11.so.6": "libx11-6",
    "libgomp.so.1": "libgomp1",
}
PACKAGES: Final = ("numba", "numpy", "open3d", "ompl", "eclipse-zenoh", "viser")
DISK_GB: Final = 2.0
SLOW_MS: Final = 150.0
SLOW_SEGMENTATION_S: Final = 0.5
"""A robot that drives on sees twice a second what is around it."""
EXIT_UNWELL: Final = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One thing that was looked at."""

    what: str
    verdict: Verdict
    detail: str


def run_doctor(command: Doctor) -> int:
    """Look at everything and print what was found; exit status 1 when something is missing."""
    if command.recording is not None:
        from app.cli.tools.doctor_file import run_file_doctor

        return run_file_doctor(command.recording, as_json=command.json)
    checks: tuple[Callable[[], list[Finding]], ...] = (
        _python,
        _libraries,
        _packages,
        _browser,
        _disk,
        _speed,
        _navigators,
    )
    findings = [finding for check in checks for finding in check()]
    if command.segmentation:
        findings.append(_segmentation(command.network))
    if command.json:
        print(json.dumps([asdict(finding) for finding in findings]))
    else:
        _print_table(findings)
    return EXIT_UNWELL if any(f.verdict == "missing" for f in findings) else 0


def _python() -> list[Finding]:
    version = platform.python_version()
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return [
        Finding(
            what="Python",
            verdict="ok" if sys.version_info >= (3, 11) else "missing",
            detail=f"{version} on {platform.system()} {platform.machine()}",
        ),
        Finding(
            what="processor cores",
            verdict="ok" if (cores or 1) >= 2 else "warning",
            detail=f"{cores}; two are enough",
        ),
    ]


def _libraries() -> list[Finding]:
    if platform.system() != "Linux":
        return []
    missing = [package for library, package in LIBRARIES.items() if not _loads(library)]
    if missing:
        detail = f"type: sudo apt-get install {' '.join(missing)}"
        return [Finding(what="system libraries", verdict="missing", detail=detail)]
    return [Finding(what="system libraries", verdict="ok", detail="all that open3d loads")]


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _packages() -> list[Finding]:
    findings: list[Finding] = []
    for name in PACKAGES:
        # On Linux the processor-only build of open3d has a name of its own.
        names = (name, f"{name}-cpu")
        version = next((v for v in map(_version, names) if v is not None), None)
        findings.append(
            Finding(
                what=name,
                verdict="ok" if version else "missing",
                detail=version or "not installed; run scripts/setup",
            )
        )
    return findings


def _version(name: str) -> str | None:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None


def _browser() -> list[Finding]:
    names = ("chromium", "chromium-browser", "google-chrome", "firefox")
    found = next((path for name in names if (path := shutil.which(name))), None)
    detail = found or "none on this machine; any browser that reaches the page will do"
    return [Finding(what="browser", verdict="ok" if found else "warning", detail=detail)]


def _disk() -> list[Finding]:
    free_gb = shutil.disk_usage(Path.cwd()).free / 1e9
    return [
        Finding(
            what="free disk",
            verdict="ok" if free_gb > DISK_GB else "warning",
            detail=f"{free_gb:.0f} GB here",
        )
    ]


def _speed() -> list[Finding]:
    """Fuse frames of a simulated home, the heaviest thing that a navigator does."""
    from app.nodes.navigator.config import NavigatorConfig
    from app.nodes.navigator.warm_up import warm_up

    marks: list[float] = []
    started = time.perf_counter()
    warm_up(NavigatorConfig(), lambda _: marks.append(time.perf_counter()))
    steps_ms = 1e3 * np.diff(marks)
    median = float(np.median(steps_ms))
    return [
        Finding(
            what="navigator step",
            verdict="ok" if median < SLOW_MS else "warning",
            detail=f"{median:.0f} ms median on small images ({SLOW_MS:.0f} ms keep up with 5 Hz)",
        ),
        Finding(what="kernels ready in", verdict="ok", detail=f"{marks[-1] - started:.1f} s"),
    ]


def _segmentation(options: Segmentation) -> Finding:
    from app.cli.tools.doctor_segmentation import measure_network
    from ippon.segmentation.errors import SegmentationError

    try:
        speed = measure_network(options)
    except (SegmentationError, ValueError) as error:
        return Finding(what="segmentation", verdict="missing", detail=str(error))
    verdict = "ok" if speed.image_s < SLOW_SEGMENTATION_S else "warning"
    return Finding(what="segmentation", verdict=verdict, detail=str(speed))


def _navigators() -> list[Finding]:
    running = running_navigators()
    if not running:
        detail = "none on this machine; start one with `ippon demo`"
        return [Finding(what="navigators", verdict="ok", detail=detail)]
    return [
        Finding(what="navigator", verdict="ok", detail=f"{n.robot} at {n.endpoint} (pid {n.pid})")
        for n in running
    ]


def _print_table(findings: list[Finding]) -> None:
    table = Table(title="ippon doctor", title_justify="left", title_style="bold")
    for column in ("", "what", "found"):
        table.add_column(column)
    for finding in findings:
        mark = Text("● " + finding.verdict, style=COLORS[finding.verdict])
        table.add_row(mark, finding.what, Text(finding.detail))
    Console().print(table)
