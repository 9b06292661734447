"""Messages that robots send and the product only reads."""

import math

import numpy as np

from app.messages.cdr import encode, header, make


def odometry(stamp_ns, x, y, yaw):
    """Return a serialized nav_msgs/Odometry."""
    pose = make(
        "geometry_msgs/msg/Pose",
        position=make("geometry_msgs/msg/Point", x=x, y=y, z=0.0),
        orientation=make(
            "geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=math.sin(yaw / 2), w=math.cos(yaw / 2)
        ),
    )
    still = make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
    twist = make("geometry_msgs/msg/Twist", linear=still, angular=still)
    covariance = np.zeros(36)
    return encode(
        "nav_msgs/msg/Odometry",
        header=header(stamp_ns, "odom"),
        child_frame_id="base_link",
        pose=make("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=covariance),
        twist=make("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=covariance),
    )


def raw_color(pixels, stamp_ns, encoding="rgb8", pad=0):
    """Return a serialized sensor_msgs/Image of (H, W, C) bytes, its rows padded by `pad`."""
    h, w, channels = pixels.shape
    rows = np.pad(pixels.reshape(h, w * channels), ((0, 0), (0, pad)), constant_values=7)
    return encode(
        "sensor_msgs/msg/Image",
        header=header(stamp_ns, "optical"),
        height=h,
        width=w,
        encoding=encoding,
        is_bigendian=0,
        step=w * channels + pad,
        data=rows.reshape(-1),
    )
