"""A robot in a simulated home that publishes what it sees over real sockets, and drives nowhere."""

import contextlib
import math
import threading
import time

import numpy as np

from app.links.network.subscription import subscribe
from app.messages import keys
from app.messages.control import decode
from app.messages.depth.depth_images import encode_depth
from app.messages.images import encode_camera, encode_color
from app.messages.motion import encode_transforms, robot_transforms
from app.messages.perception.detections import encode_detections
from app.messages.perception.heatmaps import encode_heatmap
from app.messages.status import Event, Status
from ippon.camera import PinholeCamera
from ippon.command import Command
from ippon.geometry import base_pose
from ippon.observation import Detections, Instance
from ippon.robot import ZED
from ippon.simulation.homes.generator import generate_home
from ippon.simulation.world import SimulatedWorld
from ippon.vocabulary import MATTERPORT_40

CAMERA = PinholeCamera.from_horizontal_fov(48, 30, math.radians(74.0))
PERIOD_NS = 100_000_000


class Robot:
    """Stands still and publishes what it sees, ten times a second."""

    def __init__(self, session, world=None):
        self._session = session
        if world is None:
            scene = generate_home(3)
            world = SimulatedWorld(scene, ZED, CAMERA, scene.start_poses[0], seed=0)
        world.set_labels(MATTERPORT_40, "hat")
        self._world = world
        self._frame = world.observe()
        assert self._frame.heatmap is not None
        self._heatmap = self._frame.heatmap
        self._stamp_ns = 0
        self.statuses = []
        self.events = []
        subscribe(session, f"r/{keys.STATUS}", lambda p: self.statuses.append(decode(p, Status)))
        subscribe(session, f"r/{keys.EVENT}", lambda p: self.events.append(decode(p, Event)))

    def send(self, *, jump_m=0.0, heatmap=True, lift_m=0.0, detector=None, stamp_off_ns=0,
             depth_every=1):  # fmt: skip
        frame, optical = self._frame, "optical"
        stamp = self._stamp_ns = self._stamp_ns + PERIOD_NS
        base = frame.T_world_base @ base_pose(jump_m, 0.0, 0.0, 0.0)
        mount = np.linalg.inv(frame.T_world_base) @ frame.T_world_camera
        mount[2, 3] += lift_m
        put = self._session.put
        put(f"r/{keys.TF}", encode_transforms(robot_transforms(stamp, base, mount, optical)))
        put(f"r/{keys.CAMERA_INFO}", encode_camera(CAMERA, stamp, optical))
        if heatmap:
            self.send_heatmap(stamp)
        if detector is not None:
            self.send_boxes(detector, stamp + stamp_off_ns)
        if stamp // PERIOD_NS % depth_every == 0:
            put(f"r/{keys.DEPTH}", encode_depth(frame.depth, stamp, optical))
        put(f"r/{keys.COLOR}", encode_color(frame.color, stamp, optical))

    @contextlib.contextmanager
    def sending(self):
        """Publish meanwhile, as a robot does while its navigator is asked something."""
        over = threading.Event()

        def go_on():
            while not over.wait(0.1):
                self.send()

        thread = threading.Thread(target=go_on)
        thread.start()
        try:
            yield
        finally:
            over.set()
            thread.join()

    def turn(self, yaw_rate_rad_s):
        """Turn for a tenth of a second, and publish; returns stamp and frame."""
        self._world.step(Command(yaw_rate_rad_s=yaw_rate_rad_s), PERIOD_NS / 1e9)
        self._frame = self._world.observe()
        self.send(heatmap=False)
        return self._stamp_ns, self._frame

    def send_boxes(self, detector, stamp_ns):
        self._session.put(f"r/{keys.BOXES}", encode_detections(detector, stamp_ns, "optical"))

    def send_heatmap(self, stamp_ns):
        message = encode_heatmap(self._heatmap, stamp_ns, "optical")
        self._session.put(f"r/{keys.HEATMAP}", message)

    def send_until(self, test, timeout_s=30.0, **how):
        """Publish until a status passes a test; returns that status."""
        self.statuses.clear()
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            self.send(**how)
            time.sleep(0.1)
            for status in list(self.statuses):
                if test(status):
                    return status
        raise AssertionError([(s.state, s.why, s.notes) for s in self.statuses[-3:]])


def seen_on_the_wall(label="hat"):
    h, w = CAMERA.height, CAMERA.width
    # Where the view shows one surface, 2.5 m away.
    box = (23.0, 8.0, 30.0, 22.0)
    return Detections(
        source="x", labels=(label,), ooi=None, image_size=(h, w),
        instances=(Instance(label=label, score=0.9, box_px=box),),
    )  # fmt: skip


def wait_until(condition, timeout_s=120.0):
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)
