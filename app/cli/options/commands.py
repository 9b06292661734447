"""The commands and their options; docstrings are the text of `--help`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import tyro

from app.cli.options.certificates import Certificates
from app.cli.options.evaluation import Eval
from app.cli.options.language_model import Llm
from app.cli.options.recognition import Calibrate, Recognise
from app.cli.options.ros2 import Ros2
from app.cli.options.segmentation import NavigatorSegmentation, Segmentation

Positional = tyro.conf.Positional
Speed = Literal["1", "2", "max"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Demo:
    """A simulated robot looks for an object in a simulated home, live in the browser.

    Starts the navigator, the console and the simulated robot on this machine, prints the address
    of the page, and searches. Ctrl-C ends all of them.
    """

    home: str = "24"
    """Seed of a generated home, floor:SEED for a floor of 1,000 m2 in a large building, or a folder
    with scene.glb and scene.json."""
    object: str = "hat"
    """What to look for."""
    context: str | None = None
    """What you know about where it is, in plain words. The default object comes with one."""
    port: int | None = None
    """Port of the page; without one the first free from 8080 on."""
    speed: Speed = "1"
    """Simulated time against real time; max goes as fast as the navigator answers."""
    profile: str = "zed"
    """Body, limits and camera of the robot: zed (the paper's), habitat (of its challenge), or a
    YAML file; `ippon profile` prints one to start from."""
    seed: int = 0
    """Of the camera's noise and the planner's samples."""
    voxel_size_m: float = 0.1
    """Edge of a voxel. Smaller shows more detail and costs more time."""
    headless: bool = False
    """Without the console."""
    exit_when_done: bool = False
    """End with the search: the last line of standard output is its result as JSON, and the exit
    status is 0 when the object was found, 4 when it was found and no way leads close to it."""
    no_search: bool = False
    """Wait for a query from the page or from `ippon ask` instead of searching at once."""
    record: bool = True
    """Record the session, for `ippon review`."""
    record_to: Path | None = None
    """Folder of the sessions; without one, the user's data folder."""
    config: Path | None = None
    """Configuration file, YAML or JSON, with any of the fields that `ippon config` prints. A flag
    that is given wins over the file."""
    llm: Llm = field(default_factory=Llm)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sim:
    """A simulated robot in a simulated home, on zenoh; or a picture of the home from above."""

    home: str = "24"
    """Seed of a generated home, floor:SEED for a floor of 1,000 m2 in a large building, or a folder
    with scene.glb and scene.json."""
    picture: Path | None = None
    """Write a picture of the home from above to this PNG, and end."""
    export: Path | None = None
    """Write the home as scene.glb and scene.json into this folder, and end."""
    connect: str = "tcp/127.0.0.1:7447"
    """zenoh endpoint of the navigator."""
    robot: str = "ippon"
    """Key prefix of the robot."""
    profile: str = "zed"
    """Body, limits and camera of the robot: zed (the paper's), habitat (of its challenge), or a
    YAML file; `ippon profile` prints one to start from."""
    speed: Speed = "1"
    """Simulated time against real time; max waits for the navigator's answer to each frame."""
    seed: int = 0
    """Of the camera's noise and the segmentation's errors."""
    start: int = 0
    """Which of the home's start poses to begin at."""
    rate_hz: float = 5.0
    """Frames per simulated second."""
    width: int = 400
    """Width of the camera's images in pixels; their height follows from the robot's camera."""
    parent_pid: int | None = None
    """End when this process is gone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Navigate:
    """The navigator: map, common sense, plan; turns frames into commands."""

    listen: str = "tcp/127.0.0.1:7447"
    """zenoh endpoint to listen on; robot and console connect to it."""
    robot: str = "ippon"
    """Key prefix of the robot."""
    profile: str = "zed"
    """Body, limits and camera of the robot: zed (the paper's), habitat (of its challenge), or a
    YAML file; `ippon profile` prints one to start from."""
    seed: int = 0
    """Of the planner's samples."""
    voxel_size_m: float = 0.1
    """Edge of a voxel. Smaller shows more detail and costs more time."""
    map_memory_mb: float = 1024.0
    """Bound of the map; beyond it, what was seen longest ago is given up, far parts first. 60 MB
    hold 110 m2 at voxels of 5 cm, 11 MB at 10 cm."""
    step_budget_s: float = 0.04
    """Time that planning may take of a frame: then the robot goes by the best plan so far, and the
    next frame goes on with what was left. Less answers sooner on a slow or busy machine, and the
    robot chooses among fewer places. 0 counts the work and never looks at a clock, so that a
    simulated search repeats itself (`ippon sim --speed max`)."""
    map: Path | None = None
    """File that keeps map and goals: read at the start if it is there, written every ten seconds
    and at the end. Goals that were not over are taken up again, with the robot stopped until you
    resume. The robot must know its pose in the same world frame as before."""
    config: Path | None = None
    """Configuration file, YAML or JSON, with any of the fields that `ippon config` prints. A flag
    that is given wins over the file."""
    segmentation: NavigatorSegmentation = field(default_factory=NavigatorSegmentation)
    observation_model: Path | None = None
    """JSON file of `ippon calibrate`: what the network's scores are worth; without one, the shipped
    default."""
    llm: Llm = field(default_factory=Llm)
    parent_pid: int | None = None
    """End when this process is gone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """The segmentation of a robot's images, on the robot or on a machine with a GPU."""

    connect: str = "tcp/127.0.0.1:7447"
    """zenoh endpoint of the navigator."""
    robot: str = "ippon"
    """Key prefix of the robot."""
    keep_labels: int = 4
    """Labels of each pixel that are sent; more lose less and send more bytes."""
    segmentation: Segmentation = field(default_factory=Segmentation)
    parent_pid: int | None = None
    """End when this process is gone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Console:
    """The operator console: a page that shows what the navigator does, and steers it."""

    connect: str = "tcp/127.0.0.1:7447"
    """zenoh endpoint of the navigator."""
    robot: str = "ippon"
    """Key prefix of the robot."""
    host: str = "127.0.0.1"
    """Address that the page is served on; any but this machine's own loopback needs users."""
    port: int = 8080
    """Port of the page; 0 takes any free one."""
    users: Path | None = None
    """File of users, made by `ippon user`: with one, everybody logs in."""
    tls_cert: Path | None = None
    """Certificate (PEM) to serve the page by TLS with."""
    tls_key: Path | None = None
    """Private key (PEM) of the certificate."""
    names: tuple[str, ...] = ()
    """Further host names under which the page is opened, for example robot.example.org."""
    parent_pid: int | None = None
    """End when this process is gone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """Everything that a robot's network says, as it came, into a file for `ippon review`.

    The file is an MCAP that ROS 2, Foxglove and Rerun open. Ctrl-C ends it.
    """

    out: Path | None = None
    """Folder of the sessions; each gets a folder of its own in it. Without one, the user's data
    folder."""
    connect: str | None = None
    """zenoh endpoint of the navigator; without one, the navigator running on this machine."""
    robot: str | None = None
    """Key prefix of the robot; without one, that of the navigator running on this machine."""
    max_gb: float = 8.0
    """Recording ends, and the robot goes on, when the file has this size."""
    min_free_gb: float = 2.0
    """Recording ends, and the robot goes on, when less is free on the disk."""
    sensor_hz: float = 2.0
    """Depth images and heatmaps that are kept in each second: 2 keep an hour under 2 GB. 0 keeps
    all, which a recomputation of the very same map needs."""
    wait: bool = False
    """Record only when the console's button asks for it."""
    parent_pid: int | None = None
    """End when this process is gone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class User:
    """Add a user of the console's login, or give one another password or role.

    The password is asked for, or read from standard input.
    """

    name: Positional[str]
    """Name to log in with; others read it when this user holds control."""
    users: Path
    """File of users; made when it is not there, readable by you only."""
    role: Literal["viewer", "operator", "supervisor"] = "operator"
    """viewer: watches, and may stop; operator: commands, one at a time; supervisor: may also take
    control from another."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Review:
    """The console on a recording: play it, jump to any moment, compare two; or a list of sessions.

    Nothing in it commands a robot.
    """

    paths: Positional[tuple[Path, ...]] = ()
    """A recording, two to compare, or a folder of sessions. Without any, the sessions of this
    user."""
    recompute: bool = False
    """Run the present code on the recording's images, and show what comes of it beside it."""
    set: tuple[str, ...] = ()
    """What to change for the recomputation: NAME=VALUE of the configuration, like
    map.voxel_size_m=0.05, or guidance.levels.LABEL=LEVEL, like guidance.levels.sofa=far."""
    out: Path | None = None
    """Folder for the recomputed session; that of the recording's folder without."""
    port: int = 8080
    """Port of the page; 0 takes any free one."""
    parent_pid: int | None = None
    """End when this process is gone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Export:
    """A recording as files: map, trajectory, finds, video, a report, and a scene for the browser.

    ply and glb: the map. mesh: its surface as triangles (PLY), made of the recorded depth images.
    tum and csv: where the robot was. finds: what was found, as JSON. camera and map-video: MP4.
    report: one HTML page with everything. viser and page: the scene in 3D, the page opens in any
    browser.
    """

    recording: Positional[Path]
    """A recording, or a session's folder."""
    what: Positional[tuple[str, ...]] = ()
    """ply, glb, mesh, tum, csv, finds, camera, map-video, report, viser, page; without, all."""
    out: Path | None = None
    """Folder for the files; "export" in the session's folder without."""
    color: Literal["camera", "ooi", "proximity", "height"] = "camera"
    """Colours of ply and glb, as on the page."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Replay:
    """A dataset, or a bag, as a robot: it sends what was recorded, and goes its own way.

    TUM RGB-D, 7-Scenes, ScanNet as its tools extract it, MCAP files and rosbag2 folders.
    """

    path: Positional[Path]
    """The dataset's folder, a recording, or a bag."""
    connect: str | None = None
    """zenoh endpoint of the navigator; without one, the navigator running on this machine."""
    robot: str | None = None
    """Key prefix of the robot; without one, that of the navigator running on this machine."""
    rate: float = 1.0
    """Times real time."""
    start_s: float = 0.0
    """Begin so many seconds in."""
    loop: bool = False
    """Begin again at the end."""
    heatmaps: bool = True
    """Send the heatmaps that a bag holds; off where `ippon segment` makes new ones."""
    floor_m: float | None = None
    """Height of a dataset's floor along its up; estimated without."""
    parent_pid: int | None = None
    """End when this process is gone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ask:
    """Ask a running navigator to look for something, from any terminal that reaches it."""

    object: Positional[str] = ""
    """What to look for: "hat", or a whole sentence: "find my hat, I left it on the sofa"."""
    context: str = ""
    """What you know about where it is, in plain words."""
    explain: bool = False
    """Print how near to it each common object is likely to be, why, and who says so."""
    show_prompt: bool = False
    """With --explain: print the exact question to the language model and its answer, too."""
    yes: bool = False
    """Search at once for what was read from a sentence, even where that is doubtful."""
    add_label: str | None = None
    """Tell one more kind of common object apart from now on, such as "bookcase"; an object to look
    for need not be given with it."""
    follow: bool = False
    """Stay, print what happens, and end with the search; exit status 0 when it was found, 4 when it
    was found and no way leads close to it, 1 otherwise."""
    json: bool = False
    """Print one JSON object per line instead of text."""
    connect: str | None = None
    """zenoh endpoint of the navigator; without one, the navigator running on this machine."""
    robot: str | None = None
    """Key prefix of the robot; without one, that of the navigator running on this machine."""
    take: bool = False
    """Take control from whoever holds it, for the time that the request takes."""
    timeout_s: float = 5.0
    """How long to wait for a navigator that is not ready yet, and then for an answer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Levels:
    """What common sense says about where an object is: a level for each common object."""

    object: Positional[str]
    """The object, in your own words."""
    context: str = ""
    """What you know about where it is."""
    json: bool = False
    """Print JSON instead of a table."""
    vocabulary: Literal["matterport", "laboratory"] = "matterport"
    """Which list of common objects to rate."""
    show_prompt: bool = False
    """Print the exact question to the language model and its answer, too."""
    llm: Llm = field(default_factory=Llm)


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """Write a robot's profile to start your own from; or check yours, and draw it.

    `ippon profile > scout.yaml`, change it, `ippon profile scout.yaml --picture scout.png`, then
    `ippon navigate --profile scout.yaml`. The simulated robot takes it, too.
    """

    profile: Positional[str] = "zed"
    """zed, habitat, or a YAML file."""
    picture: Path | None = None
    """Draw body and view from the side and from above into this PNG."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Config:
    """Print every configuration field with its default, unit and explanation; or check a file.

    `ippon config > search.yaml`, delete what stays as it is, change the rest, then `ippon config
    search.yaml` and `ippon navigate --config search.yaml`.
    """

    file: Positional[Path | None] = None
    """A YAML or JSON file to check: prints the fields that differ from their defaults."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Doctor:
    """What is installed, reachable and fast enough; or whether a recording is whole."""

    recording: Positional[Path | None] = None
    """A recording, or a session's folder: it is looked through, and mended where it was cut off."""
    segmentation: bool = False
    """Measure a segmentation network: images per second."""
    network: Segmentation = field(default_factory=Segmentation)
    """Which; without its checkpoint SAN is measured with random weights, which take as long."""
    json: bool = False
    """Print JSON instead of a table."""


Command = (
    Annotated[Demo, tyro.conf.subcommand("demo")]
    | Annotated[Sim, tyro.conf.subcommand("sim")]
    | Annotated[Navigate, tyro.conf.subcommand("navigate")]
    | Annotated[Segment, tyro.conf.subcommand("segment")]
    | Annotated[Console, tyro.conf.subcommand("console")]
    | Annotated[User, tyro.conf.subcommand("user")]
    | Annotated[Record, tyro.conf.subcommand("record")]
    | Annotated[Review, tyro.conf.subcommand("review")]
    | Annotated[Export, tyro.conf.subcommand("export")]
    | Annotated[Replay, tyro.conf.subcommand("replay")]
    | Annotated[Recognise, tyro.conf.subcommand("recognise")]
    | Annotated[Calibrate, tyro.conf.subcommand("calibrate")]
    | Annotated[Ask, tyro.conf.subcommand("ask")]
    | Annotated[Levels, tyro.conf.subcommand("levels")]
    | Annotated[Eval, tyro.conf.subcommand("eval")]
    | Annotated[Ros2, tyro.conf.subcommand("ros2")]
    | Annotated[Profile, tyro.conf.subcommand("profile")]
    | Annotated[Certificates, tyro.conf.subcommand("certificates")]
    | Annotated[Config, tyro.conf.subcommand("config")]
    | Annotated[Doctor, tyro.conf.subcommand("doctor")]
)
