"""Small homes of boxes and a robot that searches in them, for outcomes that must be defined."""

import dataclasses
import re

import numpy as np
import pytest

from app.view.words import Words
from ippon.evaluation.episode import EpisodeLimits, run_episode
from ippon.guidance.language.naming import resolve_object
from ippon.guidance.prior import EmbeddedPrior
from ippon.mission.goal import Goal
from ippon.mission.mission import Mission, MissionConfig
from ippon.robot import ZED
from ippon.simulation.camera.sensor_noise import NoiseConfig
from ippon.simulation.robot.mobile_base import camera_of
from ippon.simulation.scene import StartPose
from ippon.simulation.world import SimulatedWorld, WorldConfig
from ippon.vocabulary import MATTERPORT_40
from tests.boxes import boxes_scene

GERMAN = Words("de")
OF_A_MODEL = re.compile(r"( (?:agrees|disagrees|is unsure)): .*")
"""Verdict of a model, and its reason, which stays as the model gave it."""


class Searcher:
    """A robot in a home of boxes, with its mission; everything that it sees is told truthfully."""

    def __init__(self, boxes, x, y, yaw=0.0, config=None, robot=ZED):
        self.robot = robot
        self.scene = boxes_scene(boxes)
        self.world = self._world(self.scene, StartPose(x=x, y=y, z=0.0, yaw=yaw))
        self.mission = Mission(config or MissionConfig(), robot, MATTERPORT_40, seed=1)
        self.results = []

    @property
    def at(self):
        """Where the robot stands, (2,) metres."""
        return np.array([self.world.base.x_m, self.world.base.y_m])

    @property
    def last(self):
        """What the mission showed last."""
        return self.results[-1].snapshot

    def ask(self, text, goal_id=1, context=""):
        """Set a goal as the navigator does; returns it, and its levels."""
        resolved = resolve_object(text, MATTERPORT_40)
        goal = Goal.of(resolved, goal_id, context)
        guidance = EmbeddedPrior().levels(resolved, context, MATTERPORT_40)
        self.mission.goals.set_goal(goal, guidance)
        return goal, guidance

    def search(self, max_time_s, until=lambda _: False):
        """Search until it ends, time is up or `until` holds; returns this part's results."""
        first = len(self.results)
        for result in run_episode(self.world, self.mission, EpisodeLimits(max_time_s=max_time_s)):
            self.results.append(result)
            if until(result):
                break
        return self.results[first:]

    def rebuild(self, boxes):
        """Change the home under a robot that drives on as it did."""
        old, base = self.world, self.world.base
        self.scene = boxes_scene(boxes)
        self.world = self._world(
            self.scene, StartPose(x=base.x_m, y=base.y_m, z=0.0, yaw=base.yaw_rad)
        )
        self.world.stamp_ns = old.stamp_ns
        self.world.base.linear_m_s = base.linear_m_s
        self.world.base.yaw_rate_rad_s = base.yaw_rate_rad_s
        self.world.base.tilt_rad = base.tilt_rad

    def paint(self, label, colors):
        """Give the objects of a label their colours, seen by a camera with all its errors."""
        faces = self.scene.face_colors.copy()
        rows = [k for k, one in enumerate(self.scene.instances) if one.label == label]
        for k, color in zip(rows, colors, strict=True):
            faces[self.scene.face_instance == k] = color
        self.scene = dataclasses.replace(self.scene, face_colors=faces)
        base = self.world.base
        start = StartPose(x=base.x_m, y=base.y_m, z=0.0, yaw=base.yaw_rad)
        self.world = self._world(self.scene, start, NoiseConfig())

    def _world(self, scene, start, noise=None):
        camera = camera_of(self.robot, 128)
        config = WorldConfig.perfect()
        if noise is not None:
            config = dataclasses.replace(config, noise=noise)
        return SimulatedWorld(scene, self.robot, camera, start, seed=1, config=config)


@pytest.fixture
def searcher():
    """Make robots; what each of them has said must have a translation."""
    robots = []

    def make(*args, **kwargs):
        robots.append(Searcher(*args, **kwargs))
        return robots[-1]

    yield make
    snapshots = [result.snapshot for robot in robots for result in robot.results]
    texts = {s.why for s in snapshots} | {event.text for s in snapshots for event in s.events}
    texts = {OF_A_MODEL.sub(r"\1", text) for text in texts}
    assert {text for text in texts if not GERMAN.sayings.covers(text)} == set()


def boxed_room(x=6.0, y=4.0):
    """Return boxes of a closed room from (0, 0) to a corner."""
    return [
        ("floor", "floor", (-0.1, -0.1, -0.1), (x + 0.1, y + 0.1, 0.0)),
        ("ceiling", "ceiling", (-0.1, -0.1, 2.5), (x + 0.1, y + 0.1, 2.6)),
        ("wall", "wall", (-0.1, -0.1, 0.0), (0.0, y + 0.1, 2.5)),
        ("wall", "wall", (x, -0.1, 0.0), (x + 0.1, y + 0.1, 2.5)),
        ("wall", "wall", (0.0, -0.1, 0.0), (x, 0.0, 2.5)),
        ("wall", "wall", (0.0, y, 0.0), (x, y + 0.1, 2.5)),
    ]


@pytest.fixture
def room():
    return boxed_room
