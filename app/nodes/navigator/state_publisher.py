"""Publishes latched topics: configuration, labels, levels, status."""

import time

import msgspec
import zenoh

from app.links.network.latched_topic import LatchedTopic
from app.links.network.sender import Sender
from app.messages import keys
from app.messages.control import encode
from app.messages.memory import MapAlignment
from app.messages.status import SegmentationLabels, Status
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.state.planned_search import PlannedSearch
from app.nodes.navigator.status_report import level_table
from ippon.geometry import Float64Array, yaw_of
from ippon.mission.mission import Mission


class StatePublisher:
    """Publishes labels and levels when they change, and the status when it is given one."""

    def __init__(self, session: zenoh.Session, config: NavigatorConfig, sender: Sender) -> None:
        """Declare the topics and publish the configuration."""
        robot = config.robot
        self.status_at = 0.0
        """Monotonic time of the latest status."""
        self._status = LatchedTopic(session, f"{robot}/{keys.STATUS}", sender)
        self._labels = LatchedTopic(session, f"{robot}/{keys.LABELS}", sender)
        self._levels = LatchedTopic(session, f"{robot}/{keys.LEVELS}", sender)
        self._alignment = LatchedTopic(session, f"{robot}/{keys.MAP_ALIGNMENT}", sender)
        self._configuration = LatchedTopic(session, f"{robot}/{keys.CONFIGURATION}", sender)
        self._configuration.put(msgspec.json.encode(config))
        self._published_labels: SegmentationLabels | None = None
        self._published_levels: tuple[PlannedSearch, str] | None = None

    def publish_alignment(self, T_map_world: Float64Array) -> None:
        """Publish where the frame of the robot's poses lies in the frame of the map."""
        x, y, z = (float(c) for c in T_map_world[:3, 3])
        message = MapAlignment(position_map=(x, y, z), yaw_rad=yaw_of(T_map_world))
        self._alignment.put(encode(message))

    def publish_labels(self, mission: Mission) -> SegmentationLabels:
        """Publish the labels that the segmentation has to distinguish, if they changed.

        Returns:
            The labels.
        """
        asked = mission.goals.asked
        if not asked and self._published_labels is not None:
            # The object stays after the end of its search: another request would change nothing.
            asked = tuple(filter(None, (self._published_labels.ooi,)))
        common = mission.voxel_map.labels
        labels = SegmentationLabels(
            labels=list(common),
            ooi=asked[0] if asked else None,
            also=[label for label in asked[1:] if label not in common],
        )
        if labels != self._published_labels:
            self._published_labels = labels
            self._labels.put(encode(labels))
        return labels

    def publish_levels(self, active: PlannedSearch | None, rooms: str) -> None:
        """Publish the levels of the active search, if they changed.

        Args:
            active: The search; None for none.
            rooms: How the rooms that were said are used; empty where none was said.
        """
        published = self._published_levels
        same = published is not None and published[0] is active and published[1] == rooms
        if active is None or same:
            return
        self._published_levels = (active, rooms)
        self._levels.put(encode(level_table(active, rooms)))

    def publish_status(self, status: Status) -> None:
        """Publish a status."""
        self.status_at = time.monotonic()
        self._status.put(encode(status))
