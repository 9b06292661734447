"""Options of the commands that try a network on recordings; docstrings are the text of `--help`."""

from dataclasses import dataclass, field
from pathlib import Path

import tyro

from app.cli.options.segmentation import Segmentation

Positional = tyro.conf.Positional


@dataclass(frozen=True, slots=True, kw_only=True)
class Recognise:
    """Find objects in a recording or RGB-D dataset, without a robot: try a network before driving.

    Runs every frame through the network and the map and prints what would end a search. TUM RGB-D,
    7-Scenes, ScanNet as its tools extract it, sequence.json folders, MCAP files, rosbag2 folders.
    """

    path: Positional[Path]
    """The dataset's folder, a recording, or a bag."""
    find: str
    """Objects with commas between: cup,tv,sofa."""
    json: bool = False
    """Print one object a line as JSON, finds most probable first, positions in metres in the
    recording's own world frame."""
    page: Path | None = None
    """HTML file to write: each find, its images, and why it is believed."""
    voxel_size_m: float = 0.05
    """Edge of a voxel."""
    observation_model: Path | None = None
    """JSON file that says what the network's scores are worth; without one, the shipped default."""
    floor_m: float | None = None
    """Height of a dataset's floor along its up; estimated without."""
    segmentation: Segmentation = field(default_factory=Segmentation)


@dataclass(frozen=True, slots=True, kw_only=True)
class Calibrate:
    """Fit what a network's scores are worth, from recordings in which some objects are known.

    Each folder holds objects.json beside the recording: {"objects": [{"label": "cup",
    "centre_world": [x, y, z], "about_m": 0.1}], "complete_for": ["cup"], "absent": ["sofa"]},
    metres, in the recording's own world. A label in complete_for has no other object there, one in
    absent has none. The more objects, the better: a handful moves the table little.
    """

    recordings: Positional[tuple[Path, ...]]
    """Datasets' folders, recordings or bags."""
    out: Path
    """JSON file to write, for --observation-model."""
    known: Path | None = None
    """JSON file with the known objects, in place of objects.json beside each recording."""
    voxel_m: float = 0.05
    """Edge of a voxel."""
    floor_m: float | None = None
    """Height of a dataset's floor along its up; estimated without."""
    segmentation: Segmentation = field(default_factory=Segmentation)
