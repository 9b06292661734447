"""Bridge between a ROS 2 robot and IPPON: an ordinary ROS 2 node.

It carries the serialized messages of the robot's camera and pose to the navigator over zenoh, and
velocity commands back. It needs Python 3.10 to 3.12 with rclpy and eclipse-zenoh, and nothing else
of IPPON.
"""
