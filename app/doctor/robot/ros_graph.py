"""The ROS graph of a robot whose nodes have rmw_zenoh, compared with the topics of its profile."""

from collections import Counter
from collections.abc import Sequence
from typing import Final

import zenoh

from app.doctor.finding import Finding
from app.links.network.session import LinkError, open_robot_client
from app.links.rmw_zenoh.graph import Graph
from app.links.rmw_zenoh.matching import Match, match_topic
from app.links.rmw_zenoh.participant import NODE
from app.links.rmw_zenoh.protocol.names import NO_HASH
from app.links.rmw_zenoh.protocol.tokens import Entity
from app.ros2.ippon_ros2.settings import COMMANDS, NAVIGATE, STREAMS, Settings

CONNECT_S: Final = 5.0
_DO: Final = {
    "absent": "name the topic in `ros2` of the profile, or start the node",
    "type": "name another topic in `ros2` of the profile, or republish it in that type",
    "definition": "the robot's package differs from that of ROS 2: republish the topic in the "
    "usual definition",
}


class RosGraph:
    """Follows the tokens of a robot's nodes while the doctor listens to its streams.

    Args:
        session: To the navigator.
        settings: Topics, domain and router of the robot.
    """

    def __init__(self, session: zenoh.Session, settings: Settings) -> None:
        self._settings = settings
        self._own: zenoh.Session | None = None
        self._graph: Graph | None = None
        self._problem = ""
        try:
            if settings.router:
                session = self._own = open_robot_client(settings.router, CONNECT_S)
        except LinkError as error:
            self._problem = str(error)
        else:
            self._graph = Graph(session, None)

    def check(self) -> list[Finding]:
        """Return a line for the graph, and one for each topic of the profile."""
        if self._graph is None:
            return [
                Finding(
                    what="ROS graph", verdict="missing", detail=self._problem,
                    do="start `ros2 run rmw_zenoh_cpp rmw_zenohd` on the robot, or correct "
                    "`router` in the profile",
                )
            ]  # fmt: skip
        return check_graph(self._settings, self._graph.entities())

    def close(self) -> None:
        """Follow the graph no more."""
        if self._graph is not None:
            self._graph.close()
        if self._own is not None:
            self._own.close()  # pyright: ignore[reportUnknownMemberType]


def check_graph(settings: Settings, entities: Sequence[Entity]) -> list[Finding]:
    """Return a line for the graph, and one for each topic of the profile.

    Args:
        settings: Topics and domain of the robot.
        entities: Of all domains.
    """
    inside = [one for one in entities if one.domain == settings.domain]
    robot = [one for one in inside if one.node != NODE]
    if not robot:
        return [_nobody(settings.domain, entities)]
    findings = [_whole(settings.domain, inside)]
    for key, topic in settings.topics.items():
        if key in STREAMS:
            match = match_topic(key, topic, tuple(STREAMS[key][1]), "MP", robot)
        elif NAVIGATE in COMMANDS[key][1]:
            match = _match_action(topic.name, robot)
        else:
            match = match_topic(key, topic, COMMANDS[key][1], "MS", robot)
        if not (topic.is_optional and match.reason == "absent"):
            findings.append(_finding(key, topic.name, match))
    return findings


def _nobody(domain: int, entities: Sequence[Entity]) -> Finding:
    others = sorted({one.domain for one in entities if one.node != NODE})
    if others:
        numbers = ", ".join(map(str, others[:5]))
        return Finding(
            what="ROS graph", verdict="missing",
            detail=f"no node in domain {domain}; there are some in {numbers}",
            do=f"write `domain: {others[0]}` in the profile, or set ROS_DOMAIN_ID on the robot",
        )  # fmt: skip
    return Finding(
        what="ROS graph", verdict="missing", detail="no node with rmw_zenoh announces itself",
        do="start them with RMW_IMPLEMENTATION=rmw_zenoh_cpp; `router` in the profile is their "
        "router, or that one connects to the navigator",
    )  # fmt: skip


def _whole(domain: int, inside: Sequence[Entity]) -> Finding:
    count = Counter(one.kind for one in inside)
    ours = any(one.kind == "NN" and one.node == NODE for one in inside)
    detail = (
        f"domain {domain}: nodes {count['NN']}, publishers {count['MP']}, subscriptions "
        f"{count['MS']}"
    )
    if ours:
        return Finding(what="ROS graph", verdict="ok", detail=f"{detail}; the navigator is one")
    return Finding(
        what="ROS graph", verdict="warning", detail=f"{detail}; the navigator is none of them",
        do="start `ippon navigate` with this profile",
    )  # fmt: skip


def _match_action(name: str, robot: Sequence[Entity]) -> Match:
    called = f"{name}/_action/send_goal"
    servers = [one for one in robot if one.kind == "SS" and one.topic == called]
    if not servers:
        return Match(problem=f"nobody serves the action {name}", reason="absent")
    nodes = tuple(sorted({one.full_name for one in servers}))
    kind = servers[0].type.removesuffix("_SendGoal")
    if kind != NAVIGATE:
        return Match(problem=f"{name} is {kind}; needed: {NAVIGATE}", reason="type")
    return Match(type=kind, nodes=nodes, type_hash=servers[0].type_hash)


def _finding(key: str, topic: str, match: Match) -> Finding:
    what = f"topic {key}"
    if match.problem:
        verdict = "missing" if match.reason == "absent" else "failed"
        return Finding(what=what, verdict=verdict, detail=match.problem, do=_DO[match.reason])
    detail = f"{topic}: {match.type}, {match.qos}, of {', '.join(match.nodes[:3])}"
    if match.type_hash == NO_HASH:
        detail += "; without a hash, as with ROS 2 Humble: its definition is not compared"
    if match.note:
        return Finding(what=what, verdict="warning", detail=f"{detail}; {match.note}")
    return Finding(what=what, verdict="ok", detail=detail)
