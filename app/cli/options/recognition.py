"""Options of the commands that run a network on recordings; docstrings are the text of `--help`."""

from dataclasses import dataclass, field
from pathlib import Path

import tyro

from app.cli.options.segmentation import Segmentation

Positional = tyro.conf.Positional


@dataclass(frozen=True, slots=True, kw_only=True)
class Recognise:
    """Find objects in a recording or RGB-D dataset, without a robot, to test a network.

    Runs every frame through the network and the map, and prints the finds that would end a search.
    Formats: TUM RGB-D, 7-Scenes, ScanNet as extracted by its tools, sequence.json folders, MCAP
    files, rosbag2 folders.
    """

    path: Positional[Path]
    """Folder of a dataset, a recording, or a bag."""
    find: str
    """Comma-separated objects: cup,tv,sofa."""
    json: bool = False
    """Print one JSON line per object, with its finds, most probable first; positions in metres in
    the recording's world frame."""
    page: Path | None = None
    """HTML file to write: each find with its images and its evidence."""
    voxel_size_m: float = 0.05
    """Edge length of a voxel."""
    observation_model: Path | None = None
    """Observation model (JSON): the weight of the network's scores; by default the one that is
    included."""
    floor_m: float | None = None
    """Height of a dataset's floor along its up direction; by default estimated."""
    track: bool = False
    """Find the poses of a dataset by its images: for a camera that knew none, held 0.8 to 1.8 m
    high, which sees the floor once."""
    profile: str | None = None
    """Robot profile (YAML) of a bag: its section `ros2` names the topics, and its fixed camera is
    that of a bag with odometry and without tf."""
    base_frame: str = "base_link"
    """Frame of the base of a bag, for one that has no frame `base_link`, such as
    `base_footprint`."""
    segmentation: Segmentation = field(default_factory=Segmentation)


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibrate:
    """Fit an observation model of a network's scores to recordings with known objects.

    Each folder holds objects.json beside the recording: {"objects": [{"label": "cup",
    "centre_world": [x, y, z], "about_m": 0.1}], "complete_for": ["cup"], "absent": ["sofa"]},
    metres, in the recording's own world. A label in complete_for has no other objects there; a
    label in absent has none. Use many objects: a handful changes the table little.
    """

    recordings: Positional[tuple[Path, ...]]
    """Folders of datasets, recordings or bags."""
    out: Path
    """JSON file to write, for --observation-model."""
    known: Path | None = None
    """JSON file with the known objects, instead of objects.json beside each recording."""
    voxel_size_m: float = 0.05
    """Edge length of a voxel."""
    floor_m: float | None = None
    """Height of a dataset's floor along its up direction; by default estimated."""
    profile: str | None = None
    """Robot profile (YAML) of a bag: its section `ros2` names the topics, and its fixed camera is
    that of a bag with odometry and without tf."""
    base_frame: str = "base_link"
    """Frame of the base of a bag, for one that has no frame `base_link`, such as
    `base_footprint`."""
    segmentation: Segmentation = field(default_factory=Segmentation)
