"""Address of the navigator that a command asks."""

import math

from app.errors import UsageError
from app.links.network.registry import resolve_address, running_navigators
from app.messages.keys import check_prefix


def check_timeout(timeout_s: float) -> None:
    """Refuse a time that is none; zenoh takes a negative one for no limit.

    Raises:
        UsageError: It is not positive, or not finite.
    """
    if not 0.0 < timeout_s < math.inf:
        raise UsageError(f"--timeout-s is a positive number of seconds; got {timeout_s:g}")


def find_navigator(
    connect: str | None, robot: str | None, *, any_of: bool = False
) -> tuple[str, str]:
    """Return endpoint and key prefix of the navigator; with `any_of` the first of several.

    Raises:
        UsageError: The prefix is none, no navigator runs on this machine, or several do and none
            is named.
    """
    if robot is not None:
        try:
            check_prefix(robot)
        except ValueError as error:
            raise UsageError(str(error)) from error
    if connect is not None:
        return resolve_address(connect, robot)
    on_machine = running_navigators()
    running = [n for n in on_machine if robot is None or n.robot == robot]
    if len(running) == 1 or (running and any_of):
        return running[0].endpoint, running[0].robot
    if not running and on_machine:
        there = ", ".join(n.robot for n in on_machine)
        raise UsageError(f"no navigator of {robot} runs on this machine; there is {there}")
    if not running:
        raise UsageError(
            "no navigator runs on this machine, or it still prepares its first start; start one "
            "with `ippon navigate`, or everything with `ippon demo`, or name one elsewhere with "
            "--connect tcp/ADDRESS:PORT --robot PREFIX"
        )
    choices = "\n".join(f"  --robot {n.robot}   ({n.endpoint})" for n in running)
    raise UsageError(f"several navigators run on this machine; choose one:\n{choices}")
