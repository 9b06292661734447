"""A robot of real ROS 2 topics whose wheels and sensors are in the test; run by ROS 2's Python.

Serialized messages that come on `robot/TOPIC` over zenoh are published on the ROS 2 topic, and
velocities that arrive on `cmd_vel` go back as JSON on `robot/twist`.
"""

import contextlib
import faulthandler
import importlib
import json
import sys
import time

import rclpy
import zenoh
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy


def message_class(kind):
    package, _, name = kind.split("/")
    return getattr(importlib.import_module(f"{package}.msg"), name)


def main():
    options = json.loads(sys.argv[1])
    config = zenoh.Config()
    for key, value in {
        "mode": "client",
        "connect/endpoints": [options["connect"]],
        "scouting/multicast/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    session = zenoh.open(config)
    rclpy.init()
    node = rclpy.create_node("robot")
    publishers = {}
    for topic, entry in options["topics"].items():
        best_effort = entry.get("best_effort", False)
        latched = entry.get("latched", False)
        qos = QoSProfile(
            depth=10,
            reliability=ReliabilityPolicy.BEST_EFFORT
            if best_effort
            else ReliabilityPolicy.RELIABLE,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
        )
        publishers[topic] = node.create_publisher(message_class(entry["type"]), topic, qos)

    def receive(sample):
        topic = str(sample.key_expr)[len("robot") :]
        if topic in publishers:
            publishers[topic].publish(sample.payload.to_bytes())

    subscriber = session.declare_subscriber("robot/**", receive)

    def drive(message):
        twist = getattr(message, "twist", message)
        values = {"linear": twist.linear.x, "turn": twist.angular.z, "at": time.monotonic()}
        if twist is not message:
            values["stamp"] = message.header.stamp.sec
        session.put("robot/twist", json.dumps(values))

    node.create_subscription(message_class(options["cmd_type"]), options["cmd_vel"], drive, 10)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    with contextlib.suppress(KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        rclpy.spin(node)
    del subscriber
    session.close()
    # The middleware hangs at times as it ends, as `ippon_ros2.__main__` says.
    faulthandler.dump_traceback_later(5.0, exit=True)
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
