"""The layout of Foxglove's panels, as the file that its menu “Import from file” reads."""

import json
from typing import Any, Final

import foxglove.layouts as fl

from app.messages import keys
from app.messages.keys import BASE_FRAME, WORLD_FRAME
from app.nodes.viewers.foxglove_topics import BODY_KEY, LOG_KEY
from app.recording.channels import MARKERS_KEY, ros_name
from app.view.colors import PATH, hex_of

VOXEL_M: Final = 0.1
"""Edge of a drawn voxel: the navigator's default."""
DEPTH_RANGE_M: Final = 5.0


def layout_json() -> str:
    """Return the layout: maps, images, plot, status and log."""
    configs: dict[str, Any] = {
        "3D!probability": _scene("map/probability"),
        "3D!proximity": _scene("map/proximity"),
        "3D!colors": _scene("map/colors"),
        "Image!color": _image(ros_name(keys.COLOR), ros_name(keys.CAMERA_INFO)),
        "Image!depth": _image(ros_name(keys.DEPTH_RAW), ros_name(keys.CAMERA_INFO), depth=True),
        "Plot!search": _plot(ros_name(keys.STATUS)),
        "RawMessages!status": fl.RawMessagesConfig(topic_path=ros_name(keys.STATUS)),
        "RosOut!log": fl.LogConfig(topic_to_render=ros_name(LOG_KEY)),
        "Tab!maps": {
            "activeTabIdx": 0,
            "tabs": [
                {"title": "Probability", "layout": "3D!probability"},
                {"title": "Proximity", "layout": "3D!proximity"},
                {"title": "Camera colours", "layout": "3D!colors"},
            ],
        },
    }
    images = _split("row", "Image!color", "Image!depth", 50)
    words = _split("row", "RawMessages!status", "RosOut!log", 50)
    side = _split("column", images, _split("column", "Plot!search", words, 50), 40)
    return json.dumps(
        {
            "configById": {name: _plain(config) for name, config in configs.items()},
            "globalVariables": {},
            "userNodes": {},
            "playbackConfig": {"speed": 1},
            "layout": _split("row", "Tab!maps", side, 60),
        },
        indent=2,
    )


def _scene(cloud: str) -> fl.ThreeDeeConfig:
    voxels = fl.BaseRendererPointCloudTopicSettings(
        visible=True,
        color_mode="rgb",
        color_field="rgb",
        point_shape="cube",
        cube_size=VOXEL_M,
    )
    return fl.ThreeDeeConfig(
        follow_tf=WORLD_FRAME,
        fixed_frame=WORLD_FRAME,
        follow_mode="follow-none",
        camera_state=fl.ThreeDeeCameraState(distance=14.0, perspective=True, phi=35.0),
        transforms={
            f"frame:{BASE_FRAME}": fl.BaseRendererLayerSettingsTransform(visible=True),
        },
        topics={
            ros_name(cloud): voxels,
            ros_name(MARKERS_KEY): fl.BaseRendererRosMarkerTopicSettings(visible=True),
            ros_name(BODY_KEY): fl.BaseRendererRosMarkerTopicSettings(visible=True),
            ros_name(keys.PLAN_PATH): fl.BaseRendererPosesTopicSettings(
                visible=True, type="line", line_width=0.05, gradient=(hex_of(PATH), hex_of(PATH))
            ),
            ros_name(keys.CAMERA_INFO): fl.BaseRendererCameraTopicSettings(visible=True),
        },
    )


def _image(topic: str, camera: str, *, depth: bool = False) -> fl.ImageConfig:
    if not depth:
        mode = fl.ImageModeConfig(image_topic=topic, calibration_topic=camera)
    else:
        mode = fl.ImageModeConfig(
            image_topic=topic,
            calibration_topic=camera,
            color_mode="colormap",
            color_map="turbo",
            min_value=0.0,
            max_value=1e3 * DEPTH_RANGE_M,
        )
    return fl.ImageConfig(image_mode=mode)


def _plot(status: str) -> fl.PlotConfig:
    shown = (
        ("best_ooi", "best match"),
        ("explored_m2", "explored, m²"),
        ("path_length_m", "path, m"),
    )
    return fl.PlotConfig(
        paths=[fl.PlotSeries(value=f"{status}.{name}", label=text) for name, text in shown],
        show_legend=True,
        x_axis_val="timestamp",
    )


def _split(direction: str, first: Any, second: Any, percentage: int) -> dict[str, Any]:
    return {
        "direction": direction,
        "first": first,
        "second": second,
        "splitPercentage": percentage,
    }


def _plain(config: Any) -> Any:
    return json.loads(config.to_json()) if hasattr(config, "to_json") else config
