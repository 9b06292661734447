"""State of the page around the scene: status bar and notices."""

from typing import Literal

import msgspec

from app.messages.driving import DriveStatus, WalkStatus
from app.messages.lease import LeaseStatus
from app.messages.plain_text import as_sentence
from app.messages.status import Status, awaited_find, goal_of
from app.nodes.console.link.navigator_link import NavigatorLink
from app.nodes.console.link.versions import difference
from app.nodes.console.scene.click_explanation import ClickExplanation
from app.view.model.unfound_goals import UnfoundGoal
from app.view.shown_state import ShownState, shown_state
from app.view.words import Words

LIVE_S = 2.0


class ShownFind(msgspec.Struct, frozen=True, kw_only=True):
    """A find that waits for a verdict."""

    goal_id: int
    number: int | None
    """Among the finds of the goal; None from a navigator that does not number them."""
    name: str
    position: tuple[float, float, float]
    size: tuple[float, float, float]
    perhaps: bool
    """It was doubted before."""
    out_of_reach_m: float | None
    """Distance from the nearest reachable place; None when it is reachable."""


class ShownUnfound(msgspec.Struct, frozen=True, kw_only=True):
    """The goal that ended last without a find."""

    goal_id: int
    took_s: float | None
    """Time that its search took: another run of the navigator counts from the same number."""
    name: str
    places: int
    """Number of the likeliest places that the Search tab lists."""


class ShellState(msgspec.Struct, tag="state", frozen=True, kw_only=True):
    """State shown in the status bar and the notices of the page."""

    instance: str
    """Random; changes when the console restarts."""
    robot: str = ""
    link: Literal["waiting", "live", "silent"]
    link_text: str = ""
    starting: Literal["", "loading", "compiling"] = ""
    """What the navigator does before it takes requests; empty if nothing is known of it."""
    silent_s: float = 0.0
    state: ShownState | None = None
    why: str = ""
    object: str = ""
    context: str = ""
    elapsed_s: float = 0.0
    frame_age_ms: float | None = None
    best_ooi: float = 0.0
    unfound: ShownUnfound | None = None
    """None once the object is searched for again."""
    drive: DriveStatus = DriveStatus()
    walk: WalkStatus | None = None
    """Directions for the person who carries the camera; None for none."""
    lease: LeaseStatus = LeaseStatus()
    warning: str = ""
    """Warning about the console, for example a version difference."""
    has_map: bool = False
    find: ShownFind | None = None
    """The find that waits for a verdict; None without one."""
    explanation: ClickExplanation | None = None
    goals: int = 0
    """Checksum of the list of goals, which pages fetch when it changes."""
    waiting: int = 0
    """Number of goals that wait."""
    calls: int = 0
    """Checksum of the calls, which pages fetch when it changes."""


def waiting_state(instance: str, link: NavigatorLink, unread: str) -> ShellState:
    """Return the state without a status: why there is none."""
    problem = as_sentence(link.say.said(link.problem))
    nobody = link.say("link.nobody", endpoint=link.endpoint, robot=link.robot)
    starting = "loading" if link.is_awaited else ""
    if link.is_compiling:
        starting = "compiling"
    return ShellState(
        instance=instance,
        link="waiting",
        link_text=unread or problem or nobody,
        starting="" if unread else starting,
    )


def shell_state(
    status: Status,
    link: NavigatorLink,
    lost: UnfoundGoal | None,
    *,
    instance: str,
    has_map: bool,
    explanation: ClickExplanation | None,
    goals: int,
    calls: int,
) -> ShellState:
    """Return the state of a status.

    Args:
        status: The latest status.
        link: Tells how long the navigator was silent.
        lost: The goal that ended last without a find.
        instance: And the other fields by their names.
        has_map: See `ShellState`.
        explanation: See `ShellState`.
        goals: See `ShellState`.
        calls: See `ShellState`.
    """
    silence, goal = link.silence_s(), status.goal
    return ShellState(
        instance=instance,
        robot=status.robot,
        link="live" if silence < LIVE_S else "silent",
        silent_s=round(silence) if silence >= LIVE_S else 0.0,
        state=shown_state(status),
        why=status.why,
        object=link.say.goal(goal) if goal is not None else "",
        context=goal.context if goal is not None else "",
        elapsed_s=float(int(status.elapsed_s)),
        frame_age_ms=round(status.timings.frame_age_ms) if status.frames else None,
        best_ooi=round(status.best_ooi, 2),
        has_map=has_map,
        find=_find(status, link.say),
        unfound=_unfound(lost, link.say),
        drive=status.drive,
        walk=status.walk,
        lease=link.lease_in(status),
        warning=difference(status.version, link.say),
        explanation=explanation,
        goals=goals,
        waiting=len(status.queue),
        calls=calls,
    )


def _find(status: Status, say: Words) -> ShownFind | None:
    find = awaited_find(status)
    if find is None:
        return None
    goal = goal_of(status, find.goal_id)
    return ShownFind(
        goal_id=find.goal_id,
        number=find.number or None,
        name=say.name(find.object) if goal is None else say.find(goal, find.number),
        position=find.position_world,
        size=find.size_m,
        perhaps=find.perhaps,
        out_of_reach_m=find.out_of_reach_m,
    )


def _unfound(lost: UnfoundGoal | None, say: Words) -> ShownUnfound | None:
    if lost is None:
        return None
    name, places = ", ".join(map(say.goal, lost.goals)), len(lost.places or ())
    return ShownUnfound(
        goal_id=lost.goal.goal_id, took_s=lost.goal.took_s, name=name, places=places
    )
