"""Whether commands reach a robot, and how long they take."""

from typing import Final

import numpy as np

from app.doctor.finding import Finding
from app.doctor.robot.clocks import rate_hz
from app.doctor.robot.samples import Samples
from app.messages import keys
from ippon.robot import RobotProfile

LEAST_HZ: Final = 20.0
LATE_S: Final = 0.5


def check_commands(
    samples: Samples, profile: RobotProfile | None, *, expects_commands: bool
) -> list[Finding]:
    """Check who takes commands, and how soon a command follows its image.

    Args:
        samples: What came while listening.
        profile: Says what the robot takes; None for velocities.
        expects_commands: False where streams are missing: then a navigator is rightly silent.
    """
    findings: list[Finding] = []
    if len(samples.bridges) > 1:
        names = " and ".join(key.rsplit("/", 1)[-1] for key in samples.bridges[:2])
        findings.append(
            Finding(
                what="bridge", verdict="failed", detail=f"two bridges serve this robot: {names}",
                do="end one of them, or give its robot another prefix",
            )
        )  # fmt: skip
    if profile is not None and profile.is_carried:
        return findings
    goals = profile is not None and profile.takes_goals
    taken = samples.takes_goals if goals else samples.takes_velocities
    key = keys.NAVIGATION_GOAL if goals else keys.CMD_VEL
    if not taken:
        findings.append(
            Finding(
                what="commands", verdict="failed", detail=f"nobody listens to {key}",
                do="start the bridge on the robot, or let it subscribe to this key",
            )
        )  # fmt: skip
        return findings
    if samples.onlookers and not (samples.bridges or samples.simulated):
        # Console and recorder subscribe to commands, too.
        findings.append(
            Finding(
                what="commands", verdict="warning",
                detail=f"it is not known whether the robot listens to {key}: a console, viewer or "
                "recorder is there, which may be the only listener",
                do="close it, and check again",
            )
        )  # fmt: skip
        return findings
    if goals and profile is not None and profile.takes_velocities and not samples.takes_velocities:
        findings.append(
            Finding(
                what="driving by hand", verdict="warning",
                detail=f"nobody listens to {keys.CMD_VEL}",
                do="start the bridge with this profile, or leave `velocities` out of `takes`",
            )
        )  # fmt: skip
    commands = keys.NAVIGATION_ACTIVE if goals else keys.CMD_VEL
    if expects_commands or samples.arrivals.get(commands):
        findings.append(_loop(samples, key, goals=goals))
    return findings


def _loop(samples: Samples, key: str, *, goals: bool) -> Finding:
    commands = samples.arrivals.get(keys.NAVIGATION_ACTIVE if goals else keys.CMD_VEL, [])
    if not samples.navigator:
        detail = f"somebody listens to {key}; no navigator commands"
        do = "start `ippon navigate` to check the loop, too"
        return Finding(what="commands", verdict="warning", detail=detail, do=do)
    if not commands:
        detail = f"somebody listens to {key}; the navigator is silent"
        do = "it commands from the first frame on: see the streams above"
        return Finding(what="commands", verdict="warning", detail=detail, do=do)
    hz = rate_hz(commands)
    detail = f"{hz:.0f} a second"
    delays = [] if goals else _delays_s(samples)
    if delays:
        detail += f", {1e3 * float(np.median(delays)):.0f} ms from image to command"
    if hz < LEAST_HZ or (delays and float(np.median(delays)) > LATE_S):
        return Finding(
            what="commands", verdict="warning", detail=detail,
            do="the navigator is slow or the network loses messages: `ippon doctor` measures this "
            "machine",
        )  # fmt: skip
    return Finding(what="commands", verdict="ok", detail=detail)


def _delays_s(samples: Samples) -> list[float]:
    """Return the seconds from the arrival of each image to that of the first command on it."""
    _, images = samples.of(keys.COLOR, keys.COLOR_RAW)
    first: dict[int, int] = {}
    for command in samples.arrivals.get(keys.CMD_VEL, []):
        if command.stamp_ns is not None:
            first.setdefault(command.stamp_ns, command.at_ns)
    pairs = [(i.at_ns, first.get(i.stamp_ns)) for i in images if i.stamp_ns is not None]
    return [1e-9 * (at - since) for since, at in pairs if at is not None and at > since]
