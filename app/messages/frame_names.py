"""Names of the coordinate frames that the product's messages use, as REP 105 has them."""

from typing import Final

WORLD_FRAME: Final = "map"
BASE_FRAME: Final = "base_link"
ODOMETRY_FRAME: Final = "odom"
"""World of the odometry, where a message names none."""
CAMERA_FRAME: Final = "camera_color_optical_frame"
"""Camera of the simulated robot, and of datasets."""
