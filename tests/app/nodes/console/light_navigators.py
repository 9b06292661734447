"""Navigators as a router shows them: a token, a status, a pose; without a map."""

import threading

import msgspec

from app.links.network.session import open_client
from app.messages import keys
from app.messages.control import encode
from app.messages.motion import StampedTransform, encode_transforms
from app.messages.status import GoalStatus
from app.nodes.navigator.config import NavigatorConfig
from ippon.geometry import base_pose
from ippon.robot import ZED
from tests.app.nodes.console.drawn_home import status_of


class LightNavigator:
    """One navigator that searches for an object and publishes at a rate."""

    def __init__(self, zenoh_port, robot, wanted="hat", hz=5.0, profile=ZED):
        self.robot, self.ticks = robot, 0
        self.goal = GoalStatus(goal_id=1, object=wanted, outcome="active")
        self._hz = hz
        self._session = open_client(f"tcp/127.0.0.1:{zenoh_port}")
        key = f"{robot}/{keys.STATUS}"
        self._session.declare_queryable(key, lambda query: query.reply(key, self.status()))
        about = f"{robot}/{keys.CONFIGURATION}"
        text = msgspec.json.encode(NavigatorConfig(robot=robot, profile=profile))
        self._session.declare_queryable(about, lambda query: query.reply(about, text))
        self._token = self._session.liveliness().declare_token(f"{robot}/{keys.NAVIGATOR_ALIVE}")
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def status(self):
        return encode(status_of(robot=self.robot, goal=self.goal, frames=self.ticks))

    def close(self):
        self._stop.set()
        self._thread.join(5)
        self._session.close()

    def _run(self):
        while not self._stop.wait(1.0 / self._hz):
            self.ticks += 1
            pose = StampedTransform(
                stamp_ns=self.ticks,
                parent="map",
                child="base_link",
                T_parent_child=base_pose(1.0 + 0.01 * self.ticks, 2.0, 0.0, 0.0),
            )
            self._session.put(f"{self.robot}/{keys.TF}", encode_transforms([pose]))
            self._session.put(f"{self.robot}/{keys.STATUS}", self.status())
