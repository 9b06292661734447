"""Rates, stamps and delays of a robot's streams."""

from typing import Final

import numpy as np

from app.doctor.finding import Finding, Verdict
from app.doctor.robot.samples import Arrival, Samples
from app.messages import keys
from app.messages.cdr import MessageError
from app.messages.motion import decode_transforms

SLOW_HZ: Final = 2.0
LATE_S: Final = 0.3
APART_S: Final = 0.5
"""Difference of two streams' stamps, delays included, from which their clocks differ."""
SET_S: Final = 2.0
"""Difference of robot and this machine from which a clock is not set."""
EARLY_S: Final = 0.05
"""Stamps this far in the future are no error of the synchronisation."""
FEWEST: Final = 5
"""Images from which stamps that stand still are told."""
_TIMES: Final = ((86400.0, "days"), (3600.0, "hours"), (60.0, "minutes"), (1.0, "s"))


def rate_hz(arrivals: list[Arrival]) -> float:
    """Return messages a second, 0 with fewer than two."""
    if len(arrivals) < 2:
        return 0.0
    span = (arrivals[-1].at_ns - arrivals[0].at_ns) * 1e-9
    return (len(arrivals) - 1) / span if span > 0.0 else 0.0


def check_clocks(
    samples: Samples, clock_offset_s: float = 0.0, *, is_live: bool = True
) -> list[Finding]:
    """Compare the stamps of colour, depth and pose with each other and with this machine.

    Args:
        samples: What the robot sent.
        clock_offset_s: How far the camera's clock is behind that of the poses, by the profile.
        is_live: It was sent now, by the clock of this machine.
    """
    offsets = _offsets_s(samples)
    findings: list[Finding] = []
    if "colour" not in offsets:
        return findings
    _, colors = samples.of(keys.COLOR, keys.COLOR_RAW)
    stamps = {a.stamp_ns for a in colors}
    if len(colors) >= FEWEST and len(stamps) <= len(colors) // 2:
        return [
            Finding(
                what="clock", verdict="failed",
                detail=f"the stamps do not advance: {len(colors)} colour images have {len(stamps)} "
                "stamps",
                do="let the driver stamp each image when it is taken; with use_sim_time see that "
                "something publishes /clock",
            )
        ]  # fmt: skip
    least, median, largest = (float(f(offsets["colour"])) for f in (np.min, np.median, np.max))
    for name, known_s in (("depth", 0.0), ("pose", clock_offset_s)):
        if name not in offsets:
            continue
        apart = float(np.median(offsets[name])) - median + known_s
        if abs(apart) > APART_S:
            order = "older" if apart > 0.0 else "newer"
            findings.append(
                Finding(
                    what=f"clock of {name}", verdict="failed",
                    detail=f"its stamps are {spell(abs(apart))} {order} than those of colour",
                    do="stamp both with one clock: synchronise the machines (chrony), or set the "
                    "camera driver to system time; they are never joined to a frame so",
                )
            )  # fmt: skip
    if is_live:
        findings.append(_of_this_machine(least, median, largest))
    return findings


def _of_this_machine(least: float, median: float, largest: float) -> Finding:
    jitter = f"varies by {1e3 * (largest - least):.0f} ms"
    if abs(least) > SET_S:
        order = "behind" if least > 0.0 else "ahead of"
        return Finding(
            what="clock", verdict="warning",
            detail=f"the robot's clock is {spell(abs(least))} {order} this machine's; the delay "
            f"{jitter}",
            do="searching works, since only the robot's clock counts; synchronise the clocks "
            "(chrony) to see the delay. A simulated robot's clock begins at 0",
        )  # fmt: skip
    if median < -EARLY_S:
        return Finding(
            what="delay", verdict="warning",
            detail=f"the stamp of a colour image is {1e3 * -median:.0f} ms ahead of this machine's "
            f"clock; it {jitter}",
            do="synchronise the clocks (chrony); if they are, the driver stamps images too late",
        )  # fmt: skip
    late = median > LATE_S
    return Finding(
        what="delay", verdict="warning" if late else "ok",
        detail=f"{1e3 * median:.0f} ms from the stamp of a colour image to here; {jitter}",
        do="compress the images, lower their rate, or use a cable" if late else "",
    )  # fmt: skip


def rate_verdict(hz: float) -> tuple[Verdict, str]:
    """Return the verdict on a rate of images, and what to do."""
    if hz >= SLOW_HZ:
        return "ok", ""
    return "warning", "raise the camera's rate to 5 Hz, or look for losses on the network"


def spell(seconds: float) -> str:
    """Return a duration in words: `1.0 days`, `3.2 s`."""
    unit, name = next((u, n) for u, n in _TIMES if seconds >= u or n == "s")
    return f"{seconds / unit:.1f} {name}"


def _offsets_s(samples: Samples) -> dict[str, np.ndarray[tuple[int], np.dtype[np.float64]]]:
    """Return arrival less stamp of each message of colour, depth and pose, seconds."""
    found: dict[str, list[float]] = {}
    streams = {
        "colour": (keys.COLOR, keys.COLOR_RAW),
        "depth": (keys.DEPTH, keys.DEPTH_RAW),
        # As the navigator does: odometry counts where no tf comes.
        "pose": () if samples.arrivals.get(keys.TF) else (keys.ODOM,),
    }
    for name, topics in streams.items():
        arrivals = samples.of(*topics)[1] if topics else []
        pairs = [(a.at_ns, a.stamp_ns) for a in arrivals if a.stamp_ns is not None]
        found[name] = [1e-9 * (at - stamp) for at, stamp in pairs]
    for arrival in samples.arrivals.get(keys.TF, []):
        try:
            transforms = decode_transforms(arrival.payload)
        except MessageError:
            continue
        if transforms:
            newest = max(t.stamp_ns for t in transforms)
            found["pose"].append(1e-9 * (arrival.at_ns - newest))
    return {name: np.array(values) for name, values in found.items() if values}
