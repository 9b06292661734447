"""A whole search by a simulated robot that is known through topics of rmw_zenoh alone."""

import threading

import pytest

from app.links.network.session import open_client, open_router
from app.links.network.subscription import is_alive
from app.messages import keys
from app.nodes.robot_sim import RobotSim, RobotSimConfig
from app.robot_file import read_profile
from ippon.simulation.scene_reader import load_scene
from tests import ports
from tests.app.links.rmw_zenoh.rmw_robot import LATCHED, RELIABLE, SENSOR, RmwRobot

pytestmark = [pytest.mark.process, pytest.mark.slow]

PROFILE = """
name: scout
body: {radius_m: 0.25, height_m: 1.2, clearance_m: 0.06}
motion: {max_speed_m_s: 0.8, max_turn_deg_s: 60}
camera:
  {height_m: 1.2, horizontal_fov_deg: 80, width_over_height: 1.33, max_depth_m: 5, tilt: -18}
ros2:
  middleware: rmw_zenoh
  domain: 7
  router: ROUTER
  namespace: scout
  color: camera/color/image_raw/compressed
  depth: {topic: camera/depth/image_raw/compressedDepth}
  tf: tf
  tf_static: tf_static
"""
COMPRESSED = "sensor_msgs::msg::dds_::CompressedImage_"
TOPICS = {
    keys.COLOR: (COMPRESSED, SENSOR),
    keys.DEPTH: (COMPRESSED, SENSOR),
    keys.CAMERA_INFO: ("sensor_msgs::msg::dds_::CameraInfo_", RELIABLE),
    keys.TF: ("tf2_msgs::msg::dds_::TFMessage_", RELIABLE),
    keys.TF_STATIC: ("tf2_msgs::msg::dds_::TFMessage_", LATCHED),
}


class RosRobot(RobotSim):
    """A simulated robot with topics of ROS 2 under `/scout`, in place of the navigator's keys.

    Its heatmaps go to the navigator, as those of a segmentation on another machine do.
    """

    def __init__(self, ros, *arguments):
        self._ros, self._puts = ros, {}
        super().__init__(*arguments)

    def _put(self, topic, payload):
        if topic not in TOPICS:
            return super()._put(topic, payload)
        if topic not in self._puts:
            self._puts[topic] = self._ros.publisher(f"/scout/{topic}", *TOPICS[topic])
        return self._puts[topic](payload)

    def _subscribe(self, topic, take):
        if topic != keys.CMD_VEL:
            return super()._subscribe(topic, take)
        kind = "geometry_msgs::msg::dds_::TwistStamped_"
        return self._ros.subscription("/scout/cmd_vel", kind, hear=take)


def test_a_robot_behind_its_own_router_finds_a_hat(launch, tmp_path, free_endpoint, room):
    endpoint = ports.free_endpoint()
    router = open_router(endpoint)
    path = tmp_path / "scout.yaml"
    path.write_text(PROFILE.replace("ROUTER", endpoint), encoding="utf-8")
    navigator = launch("navigate", "--listen", free_endpoint, "--profile", str(path))
    navigator.wait_for_log("navigator ready", 240.0)
    session, node = open_client(free_endpoint), open_client(endpoint)
    assert is_alive(session, f"ippon/{keys.NAVIGATOR_ALIVE}", 20.0)
    scene = load_scene(room)
    config = RobotSimConfig(
        connect="", robot="ippon", profile=read_profile(str(path)), speed="1", image_width=160
    )
    robot = RosRobot(RmwRobot(node, domain=7), config, session, scene, scene.start_poses[0])
    robot.await_labels()
    stop = threading.Event()
    thread = threading.Thread(target=robot.run_real_time, args=(stop,))
    thread.start()
    try:
        ask = launch("ask", "hat", "--connect", free_endpoint, "--follow", "--json")
        status, out = ask.finish(100.0)
    finally:
        stop.set()
        thread.join()
        session.close()
        node.close()
        router.close()
    assert status == 0, (out, ask.log(), navigator.log())
    # Now and then a search touches the corner of a table (docs/results.md, Contacts), and again as
    # it backs off. Commands that come late would touch everything.
    assert robot.world.collisions <= 4
