"""Which boot of the machine this is, and how long ago it was.

A machine without a battery for its clock starts with any time of day after a power cut.
"""

import time
from pathlib import Path
from typing import Final

BOOT_ID: Final = Path("/proc/sys/kernel/random/boot_id")


def boot_id() -> str:
    """Return the number of this boot, also in containers; empty where the system tells none."""
    try:
        return BOOT_ID.read_text(encoding="ascii").strip()
    except (OSError, ValueError):
        return ""


def boot_time() -> tuple[str, float]:
    """Return `boot_id` and the seconds since that boot, or since 1970 where it is empty."""
    boot = boot_id()
    # Other clocks of the boot stand still while the machine is suspended.
    return boot, time.clock_gettime(time.CLOCK_BOOTTIME) if boot else time.time()
