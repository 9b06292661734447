"""Names of the topics under a robot's prefix, and of the coordinate frames (REP 105)."""

import re

_PREFIX = re.compile(r"[A-Za-z0-9_.-]+(/[A-Za-z0-9_.-]+)*")


def check_prefix(robot: str) -> None:
    """Refuse a key prefix that zenoh would read as a pattern or reject.

    Raises:
        ValueError: The prefix is invalid; the text says what would work.
    """
    if len(robot) > 100 or _PREFIX.fullmatch(robot) is None:
        raise ValueError(
            f"a robot's key prefix is letters, digits, '_', '.', '-', in parts joined by '/', at "
            f"most 100 of them, for example ippon/robot-1; got {robot[:100]!r}"
        )


def frame_name(name: str) -> str:
    """Return the name of a coordinate frame without the slash before it, as tf2 does."""
    return name.removeprefix("/")


WORLD_FRAME = "map"
BASE_FRAME = "base_link"
ODOMETRY_FRAME = "odom"
"""World of the odometry, where a message names none."""
CAMERA_FRAME = "camera_color_optical_frame"
"""Camera of the simulated robot, and of datasets."""

COLOR = "camera/color/image_raw/compressed"
COLOR_RAW = "camera/color/image_raw"
"""Read where no compressed images come."""
DEPTH = "camera/depth/image_raw/compressedDepth"
DEPTH_RAW = "camera/depth/image_raw"
CAMERA_INFO = "camera/color/camera_info"
TF = "tf"
COMPUTED = b"computed"
"""Attachment of `tf` that the navigator computes with the camera's mount of its profile."""
TF_STATIC = "tf_static"
ODOM = "odom"
"""Read where no tf comes."""
HEATMAP = "camera/heatmap"
BOXES = "camera/detections"
"""Boxes of a detector on the robot."""
MASKS = "camera/detections/masks"
"""Optional: masks of these detections."""
MASKS_COMPRESSED = "camera/detections/masks/compressed"
LABEL_NAMES = "camera/detections/label_info"
"""Optional: class names of the detector."""
DETECTOR_NAME = "camera/detections/vision_info"
"""Optional: name of the detector's network."""
CONTACT = "contact"
ENDED = "ended"
"""Optional: why no more images come, as plain text, such as the end of a replay."""

CMD_VEL = "cmd_vel"
CMD_TILT = "camera/cmd_tilt"
NAVIGATION_GOAL = "navigation/goal"
"""Pose that a robot which navigates by itself drives to; its stamp names the goal."""
NAVIGATION_ACTIVE = "navigation/active"
"""Stamp of the goal in force, 0 for none, with the pose where the robot stands."""
NAVIGATION_STATUS = "navigation/status"
"""From the robot: what became of the goal with a stamp."""

SEARCH = "search"
BID = "bid"
"""Would the robot take a search, and how far is its place? It does not move."""
CONTROL = "control"
GUIDANCE = "guidance"
FEEDBACK = "feedback"
SENTENCE = "guidance/sentence"
PICTURE = "guidance/picture"
VOCABULARY = "guidance/vocabulary"
QUEUE = "queue"
SEARCHES = "searches"
"""Save a search, run or delete a saved one."""
SEARCHES_SAVED = "searches/saved"
DRIVE = "drive"
GOTO = "goto"
PAINT = "paint"
PREVIEW = "preview"
INSPECT = "inspect"
MEMORY = "memory"
"""Where is, or was last, what somebody names?"""
MEMORY_NOTE = "memory/note"
"""Separate key, because saying something of a thing needs control."""
ROOMS = "rooms"
ROOM_NAME = "rooms/name"
"""Separate key, because naming a room needs control."""
TELEOP = "teleop/cmd_vel"
"""Teleoperation of the operator, with a `TeleopTag` attached."""
PAINTED = "guidance/painted"

LEASE = "lease"
LEASE_TAKE = "lease/take"
"""Separate key, so that access control can restrict it to supervisors."""

LABELS = "segmentation/labels"
LEVELS = "guidance/levels"
MAP_VOXELS = "map/voxels"
MAP_KEYFRAME = "map/keyframe"
MAP_ALIGNMENT = "map/alignment"
"""Where the frame of the robot's poses lies in the frame of a map of another day."""
PLAN_TREE = "plan/tree"
PLAN_PATH = "plan/path"
DETECTIONS = "detections"
"""Finds and candidates in the map."""
FAR_EVIDENCE = "map/glimpses"
"""Evidence of the object from images beyond the map's range."""
STATUS = "status"
EVENT = "event"

CONFIGURATION = "configuration"
"""Configuration of the navigator, for recordings."""
RECORD = "record"
"""Requests to the recorder: start, stop, note or mark."""
RECORDING = "recording"
"""Status of the recorder."""
EXCHANGE = "exchange"
"""Appended to the key of a request: the request and its reply, for recordings."""

SIM_TRUTH = "sim/truth"
"""Queryable of the simulated robot: ground truth for scoring."""
NAVIGATOR_ALIVE = "alive/navigator"
"""Liveliness token of a navigator that is ready."""
NAVIGATOR_STARTING = "alive/starting"
"""Liveliness token of a navigator that compiles and takes no request yet."""

SEEN = (HEATMAP, BOXES, MASKS, MASKS_COMPRESSED, LABEL_NAMES, DETECTOR_NAME)
"""Topics of segmentations and detectors."""

KEPT = (TF_STATIC, LABEL_NAMES, DETECTOR_NAME)
"""Topics that are sent once: their publisher keeps the last messages for late subscribers."""

ON_CHANGE = (
    CONFIGURATION, LABELS, LEVELS, MAP_ALIGNMENT, PAINTED, FAR_EVIDENCE, SEARCHES_SAVED,
)  # fmt: skip
"""Topics that the navigator publishes when they change, and of which it answers a query."""

LATCHED = (*ON_CHANGE, STATUS, PLAN_TREE, PLAN_PATH, DETECTIONS)
"""All topics of the navigator that answer a query with their last message."""

ROS_TYPES = {
    COLOR: "sensor_msgs/msg/CompressedImage",
    COLOR_RAW: "sensor_msgs/msg/Image",
    DEPTH: "sensor_msgs/msg/CompressedImage",
    DEPTH_RAW: "sensor_msgs/msg/Image",
    CAMERA_INFO: "sensor_msgs/msg/CameraInfo",
    TF: "tf2_msgs/msg/TFMessage",
    TF_STATIC: "tf2_msgs/msg/TFMessage",
    ODOM: "nav_msgs/msg/Odometry",
    HEATMAP: "ippon_msgs/msg/Heatmap",
    BOXES: "vision_msgs/msg/Detection2DArray",
    MASKS: "sensor_msgs/msg/Image",
    MASKS_COMPRESSED: "sensor_msgs/msg/CompressedImage",
    LABEL_NAMES: "vision_msgs/msg/LabelInfo",
    DETECTOR_NAME: "vision_msgs/msg/VisionInfo",
    CONTACT: "std_msgs/msg/Bool",
    CMD_VEL: "geometry_msgs/msg/TwistStamped",
    CMD_TILT: "std_msgs/msg/Float64",
    NAVIGATION_GOAL: "geometry_msgs/msg/PoseStamped",
    NAVIGATION_ACTIVE: "geometry_msgs/msg/PoseStamped",
    NAVIGATION_STATUS: "action_msgs/msg/GoalStatus",
    TELEOP: "geometry_msgs/msg/TwistStamped",
    MAP_VOXELS: "sensor_msgs/msg/PointCloud2",
    MAP_KEYFRAME: "sensor_msgs/msg/PointCloud2",
    PLAN_TREE: "ippon_msgs/msg/ViewpointTree",
    PLAN_PATH: "nav_msgs/msg/Path",
    DETECTIONS: "vision_msgs/msg/Detection3DArray",
}
"""ROS 2 type of every key with ROS messages; all other keys carry JSON, except those below."""

NOT_JSON = {
    ENDED: "plain text",
    NAVIGATOR_ALIVE: "liveliness token",
    NAVIGATOR_STARTING: "liveliness token",
}
"""Keys that carry neither ROS messages nor JSON."""
