"""Options of the commands that run nodes; docstrings are the text of `--help`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from tyro.conf import Positional

from app.cli.options.language_model import Llm
from app.cli.options.segmentation import NavigatorSegmentation, Segmentation
from app.nodes.console.config import ConsoleConfig

Speed = Literal["1", "2", "max"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Demo:
    """Search for an object with a simulated robot in a simulated home, shown in the browser.

    Starts the navigator, the console, the simulated robot and the recorder on this machine and
    prints the address of the page. Ctrl-C ends all of them.
    """

    home: str = "24"
    """Seed of a generated home, floor:SEED for a 1,000 m2 floor of a large building, a folder with
    scene.glb and scene.json, or NAME:TEXT for scenes that another package adds."""
    object: str = "hat"
    """Object to search for."""
    context: str | None = None
    """What you know about its place, in plain words. The default object has a default context."""
    port: int | None = None
    """Port of the page; by default the first free port from 8080."""
    language: str = "en"
    """Language of page and panels: en (English) or de (German)."""
    speed: Speed = "1"
    """Simulated time relative to real time; max runs as fast as the navigator answers."""
    profile: str = "zed"
    """Body, limits and camera of the robot: zed (from the paper), habitat (from the Habitat
    challenge), spot or another that `ippon profile --help` names, or a YAML file; `ippon profile`
    prints a template."""
    seed: int = 0
    """Seed of the camera's noise and the planner's samples."""
    voxel_size_m: float = 0.1
    """Edge length of a voxel. Smaller voxels show more detail and cost more time."""
    headless: bool = False
    """Do not start the console."""
    exit_when_done: bool = False
    """Exit when the search ends: the last line of standard output is the result as JSON. Exit
    status 0: object found; 4: object found, but no path leads close to it."""
    search: bool = True
    """Search for the object at once; else wait for a query from the page or from `ippon ask`."""
    record: bool = True
    """Record the session for `ippon review`."""
    record_to: Path | None = None
    """Folder of the sessions; by default in the user's data folder."""
    config: Path | None = None
    """Configuration file, YAML or JSON, with any of the fields that `ippon config` prints. Flags
    override the file."""
    llm: Llm = field(default_factory=Llm)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sim:
    """Run a simulated robot in a simulated home, or draw or export the home."""

    home: str = "24"
    """Seed of a generated home, floor:SEED for a 1,000 m2 floor of a large building, a folder with
    scene.glb and scene.json, or NAME:TEXT for scenes that another package adds."""
    picture: Path | None = None
    """Write a picture of the home from above to this PNG and exit."""
    export: Path | None = None
    """Write the home as scene.glb and scene.json into this folder and exit."""
    connect: str = "tcp/127.0.0.1:7447"
    """zenoh endpoint of the navigator."""
    robot: str = "ippon"
    """Key prefix of the robot."""
    profile: str = "zed"
    """Body, limits and camera of the robot: zed (from the paper), habitat (from the Habitat
    challenge), spot or another that `ippon profile --help` names, or a YAML file; `ippon profile`
    prints a template."""
    speed: Speed = "1"
    """Simulated time relative to real time; max waits for the navigator's answer to each frame."""
    seed: int = 0
    """Seed of the camera's noise and the segmentation's errors."""
    start: int = 0
    """Index of the start pose in the home."""
    rate_hz: float = 5.0
    """Frames per simulated second."""
    width: int = 400
    """Width of the camera's images in pixels; the height follows from the robot's camera."""
    parent_pid: int | None = None
    """Exit when this process has ended."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Navigate:
    """Run the navigator: it maps, rates places by common sense, plans, and commands the robot."""

    listen: str = "tcp/127.0.0.1:7447"
    """zenoh endpoint to listen on; robot and console connect to it."""
    robot: str = "ippon"
    """Key prefix of the robot."""
    profile: str = "zed"
    """Body, limits and camera of the robot: zed (from the paper), habitat (from the Habitat
    challenge), spot or another that `ippon profile --help` names, or a YAML file; `ippon profile`
    prints a template."""
    seed: int = 0
    """Seed of the planner's samples."""
    voxel_size_m: float = 0.1
    """Edge length of a voxel. Smaller voxels show more detail and cost more time."""
    map_memory_mb: float = 1024.0
    """Memory limit of the map; beyond it, the parts seen longest ago are dropped, distant ones
    first. 110 m2 take 60 MB with voxels of 5 cm and 11 MB with voxels of 10 cm."""
    step_budget_s: float = 0.04
    """Planning time per frame; after it the robot follows the best plan so far, and the next frame
    continues the rest. Smaller values answer sooner on a slow or busy machine and evaluate fewer
    viewpoints. 0 limits the number of evaluations instead of the time, so that a simulated search
    is repeatable (`ippon sim --speed max`)."""
    align: bool = False
    """The robot may stand anywhere in the map of --map, with a frame of its own: it turns once in
    place, and what it sees is registered on the map. If no place is certain, the map is renamed and
    a new one begins; where no image comes at all, the navigator ends and the map stays."""
    map: Path | None = None
    """File that stores map and goals, and beside it what is remembered (`ippon memory`): read at
    the start if it exists, written every ten seconds and at the end. Unfinished goals are restored,
    and the robot waits until you resume. Poses must be in the same world frame as before."""
    resume: bool = False
    """Go on with the goals of --map by itself if the last run was killed in mid-search within the
    last two minutes, for a supervisor that starts the navigator again. The robot still waits for
    Resume if the operator had stopped or paused it or drove it by hand, if the last run ended in
    order, and if the map does not fit the first image."""
    connect_robot: bool = True
    """Talk to the robot's ROS 2 nodes where the profile says `middleware: rmw_zenoh`. Without, for
    a simulated or recorded robot with that profile."""
    config: Path | None = None
    """Configuration file, YAML or JSON, with any of the fields that `ippon config` prints. Flags
    override the file."""
    segmentation: NavigatorSegmentation = field(default_factory=NavigatorSegmentation)
    observation_model: Path | None = None
    """Observation model from `ippon calibrate` (JSON): the weight of the network's scores; by
    default the one that is included."""
    llm: Llm = field(default_factory=Llm)
    parent_pid: int | None = None
    """Exit when this process has ended."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """Segment a robot's images, on the robot or on a machine with a GPU."""

    connect: str = "tcp/127.0.0.1:7447"
    """zenoh endpoint of the navigator."""
    robot: str = "ippon"
    """Key prefix of the robot."""
    keep_labels: int = 4
    """Labels sent for each pixel, and besides the further objects of a tour; more labels lose less
    information and send more bytes."""
    segmentation: Segmentation = field(default_factory=Segmentation)
    parent_pid: int | None = None
    """Exit when this process has ended."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Console(ConsoleConfig):
    """Serve the operator console: a page that shows the search and controls the robot."""

    parent_pid: int | None = None
    """Exit when this process has ended."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """Record all messages of a robot, unchanged, into a file for `ippon review`.

    The file is an MCAP that ROS 2, Foxglove and Rerun open. Ctrl-C ends the recording.
    """

    out: Path | None = None
    """Folder of the sessions, each in a folder of its own; by default in the user's data folder."""
    connect: str | None = None
    """zenoh endpoint of the navigator; by default the navigator running on this machine."""
    robot: str | None = None
    """Key prefix of the robot; by default that of the navigator running on this machine."""
    max_gb: float = 8.0
    """File size at which the recording ends; the robot continues."""
    min_free_gb: float = 2.0
    """Free disk space below which the recording ends; the robot continues."""
    sensor_hz: float = 2.0
    """Depth images and heatmaps recorded per second: with 2, an hour takes less than 2 GB. 0
    records all of them, which an identical recomputation of the map needs."""
    wait: bool = False
    """Record only when requested in the console."""
    parent_pid: int | None = None
    """Exit when this process has ended."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Review:
    """Show recordings in the console: play, jump to any moment, compare two, list sessions.

    It sends no command to a robot.
    """

    paths: Positional[tuple[Path, ...]] = ()
    """A recording, two recordings to compare, or a folder of sessions; by default the sessions of
    this user."""
    recompute: bool = False
    """Run the current code on the recording's images and show the result beside the recording."""
    set: tuple[str, ...] = ()
    """Changes for the recomputation: NAME=VALUE of the configuration, such as
    map.voxel_size_m=0.05, or guidance.levels.LABEL=LEVEL, such as guidance.levels.sofa=far."""
    out: Path | None = None
    """Folder for the recomputed session; by default `recomputed` in the session's folder."""
    port: int = 8080
    """Port of the page; 0 selects any free port."""
    language: str = "en"
    """Language of page and panels: en (English) or de (German)."""
    parent_pid: int | None = None
    """Exit when this process has ended."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Replay:
    """Publish a dataset or a bag as a robot; commands have no effect on it.

    Formats: TUM RGB-D, 7-Scenes, ScanNet as extracted by its tools, MCAP files, rosbag2 folders.
    """

    path: Positional[Path]
    """Folder of a dataset, a recording, or a bag."""
    connect: str | None = None
    """zenoh endpoint of the navigator; by default the navigator running on this machine."""
    robot: str | None = None
    """Key prefix of the robot; by default that of the navigator running on this machine."""
    rate: float = 1.0
    """Speed as a multiple of real time."""
    start_s: float = 0.0
    """Time from the beginning at which to start."""
    loop: bool = False
    """Restart at the end."""
    heatmaps: bool = True
    """Send the heatmaps of a bag; switch off where `ippon segment` makes new ones."""
    poses: bool = True
    """Send the recorded poses; switch off for a navigator that tracks the camera (profile
    hand-held), and for recordings without poses."""
    floor_m: float | None = None
    """Height of a dataset's floor along its up direction; by default estimated."""
    profile: str | None = None
    """Robot profile (YAML) of a bag: its section `ros2` names the topics, and its fixed camera is
    that of a bag with odometry and without tf."""
    base_frame: str = "base_link"
    """Frame of the base of a bag, for one that has no frame `base_link`, such as
    `base_footprint`."""
    parent_pid: int | None = None
    """Exit when this process has ended."""


Node = Demo | Sim | Navigate | Segment | Console | Record | Review | Replay
