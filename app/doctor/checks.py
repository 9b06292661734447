"""Checks of this machine: installed packages, running navigators, speed."""

import ctypes
import importlib.metadata
import os
import platform
import shutil
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np

from app.doctor.finding import Finding
from app.doctor.segmentation_speed import measure_network
from app.links.network.registry import running_navigators
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.warm_up import warm_up
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.errors import SegmentationError

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
"""Two images per second suffice for a robot in motion."""


def check_machine(tell: Callable[[str], None]) -> list[Finding]:
    """Run every check except that of the segmentation, which loads a network.

    Args:
        tell: Called with what is checked next, before it is.
    """
    checks: tuple[tuple[str, Callable[[], list[Finding]]], ...] = (
        ("Python", _python),
        ("system libraries", _libraries),
        ("packages", _packages),
        ("browser", _browser),
        ("disk", _disk),
        ("speed; the first time on a machine its code is compiled, up to a minute", _speed),
        ("navigators", _navigators),
    )
    findings: list[Finding] = []
    for what, check in checks:
        tell(what)
        findings += check()
    return findings


def check_segmentation(config: SegmentationConfig, models: Path) -> Finding:
    """Measure a segmentation network.

    Args:
        config: The network.
        models: Folder of the checkpoints.
    """
    try:
        speed = measure_network(config, models)
    except (SegmentationError, ValueError) as error:
        return Finding(what="segmentation", verdict="missing", detail=str(error))
    verdict = "ok" if speed.image_s < SLOW_SEGMENTATION_S else "warning"
    return Finding(what="segmentation", verdict=verdict, detail=str(speed))


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
    return [
        Finding(what="system libraries", verdict="ok", detail="all libraries that open3d loads")
    ]


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _packages() -> list[Finding]:
    findings: list[Finding] = []
    for name in PACKAGES:
        # On Linux the CPU-only build of open3d has a different name.
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
    detail = found or "none on this machine; any browser that reaches the page works"
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
    """Time the fusion of frames of a simulated home, the slowest part of a navigator's step."""
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


def _navigators() -> list[Finding]:
    running = running_navigators()
    if not running:
        detail = (
            "none on this machine (one that still prepares is not listed); start one with "
            "`ippon navigate`, or everything with `ippon demo`"
        )
        return [Finding(what="navigators", verdict="ok", detail=detail)]
    return [
        Finding(what="navigator", verdict="ok", detail=f"{n.robot} at {n.endpoint} (pid {n.pid})")
        for n in running
    ]
