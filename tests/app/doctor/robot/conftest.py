"""What a simulated robot sends in three seconds, without a network; and what bad ones send."""

import dataclasses

import pytest

from app.doctor.robot.samples import Samples
from app.nodes.robot_sim import RobotSim, RobotSimConfig
from ippon.robot import ZED
from ippon.simulation.scene import StartPose
from tests.boxes import boxes_scene

NOW_NS = 1_760_000_000_000_000_000
BOXES = [
    ("floor", "floor", (-2.0, -2.0, -0.1), (6.0, 4.0, 0.0)),
    ("wall", "wall", (4.5, -2.0, 0.0), (4.6, 4.0, 2.5)),
    ("chair", "chair", (2.5, 0.2, 0.0), (3.0, 0.7, 0.9)),
    ("table", "table", (2.2, -1.2, 0.0), (3.2, -0.6, 0.75)),
]


class Wire:
    """Stands in for zenoh: keeps what is published."""

    def __init__(self):
        self.samples = Samples(seconds=3.0, navigator=True, takes_velocities=True)
        self.at_ns = NOW_NS

    def declare_publisher(self, key, **_):
        topic = key.removeprefix("r/")

        class Publisher:
            put = staticmethod(lambda payload: self.samples.add(topic, payload, self.at_ns))

        return Publisher()

    def declare_subscriber(self, *_, **__):
        return None

    def liveliness(self):
        return self

    def declare_queryable(self, *_):
        return None


@pytest.fixture(scope="session")
def recorded():
    wire = Wire()
    scene = boxes_scene(BOXES)
    scene = dataclasses.replace(
        scene, face_colors=(scene.face_instance[:, None] * [50, 37, 61] % 255).astype("u1")
    )
    config = RobotSimConfig(connect="", robot="r", image_width=160)
    robot = RobotSim(config, wire, scene, StartPose(x=0.0, y=0.0, z=0.0, yaw=0.0))
    robot.world.stamp_ns = NOW_NS - 30_000_000
    for k in range(15):
        wire.at_ns = NOW_NS + k * 200_000_000
        robot.publish(robot.world.observe())
        for _ in range(5):
            robot.world.step(None, 0.04)
            wire.at_ns += 40_000_000
            robot._publish_transforms()
    return wire.samples


@pytest.fixture
def samples(recorded):
    """A copy that a test may spoil."""
    return dataclasses.replace(
        recorded,
        arrivals={
            key: [dataclasses.replace(one) for one in several]
            for key, several in recorded.arrivals.items()
        },
    )


@pytest.fixture
def change(samples):
    """Return what replaces the payloads of a key."""

    def change(key, function, new_key=None):
        old = samples.arrivals.pop(key)
        for one in old:
            samples.add(new_key or key, function(one.payload), one.at_ns)

    return change


@pytest.fixture
def profile():
    return ZED
