"""Messages that robots send and the product only reads."""

import io
import math

import numpy as np
from PIL import Image

from app.messages.cdr import encode, header, make

STAMP = 12_345_678_901
FRAME = "camera_color_optical_frame"


def odometry(stamp_ns, x, y, yaw, child="base_link", *, lost=False):
    """Return a serialized nav_msgs/Odometry; with a null quaternion if `lost`."""
    z, w = (0.0, 0.0) if lost else (math.sin(yaw / 2), math.cos(yaw / 2))
    pose = make(
        "geometry_msgs/msg/Pose",
        position=make("geometry_msgs/msg/Point", x=x, y=y, z=0.0),
        orientation=make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=z, w=w),
    )
    still = make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
    twist = make("geometry_msgs/msg/Twist", linear=still, angular=still)
    covariance = np.zeros(36)
    return encode(
        "nav_msgs/msg/Odometry",
        header=header(stamp_ns, "odom"),
        child_frame_id=child,
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


def compressed(format_, data):
    """Return a serialized sensor_msgs/CompressedImage of `STAMP` and `FRAME`."""
    return encode(
        "sensor_msgs/msg/CompressedImage",
        header=header(STAMP, FRAME),
        format=format_,
        data=np.frombuffer(data, np.uint8),
    )


def png(array):
    """Return an array as the bytes of a PNG."""
    out = io.BytesIO()
    Image.fromarray(array).save(out, "PNG")
    return out.getvalue()
