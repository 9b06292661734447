"""Options of the commands that do one thing and exit; docstrings are the text of `--help`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from tyro.conf import Positional

from app.cli.options.language_model import Llm
from app.cli.options.segmentation import Segmentation


@dataclass(frozen=True, slots=True, kw_only=True)
class User:
    """Add a user of the console's login, or change a user's password or role.

    The password is asked for, or read from standard input.
    """

    name: Positional[str]
    """Login name; other users see it while this user has control."""
    users: Path
    """File of users; it is created if missing, readable by you only."""
    role: Literal["viewer", "operator", "supervisor"] = "operator"
    """viewer: watches, and may stop the robot; operator: commands, one at a time; supervisor: may
    also take control from another user."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Export:
    """Export a recording: map, trajectory, finds, videos, a report, and a 3D scene.

    ply and glb: the map. mesh: its surface as triangles (PLY), from the recorded depth images.
    tum and csv: the robot's trajectory. finds: the found objects as JSON. camera and map-video:
    MP4. report: one self-contained HTML page. viser and page: the 3D scene, page for any browser.

    Several sessions on one page: `ippon export A B report`, or `ippon export FOLDER report` for all
    in a folder.
    """

    recording: Positional[Path]
    """A recording, the folder of a session, or a folder of sessions."""
    what: Positional[tuple[str, ...]] = ()
    """ply, glb, mesh, tum, csv, finds, camera, map-video, report, viser, page, or an export that
    another package adds; by default all. Before `report`, further recordings."""
    out: Path | None = None
    """Folder for the files; by default "export" in the session's folder, or export-NAME where the
    folder has other recordings than NAME."""
    language: str = "en"
    """Language of the report: en (English) or de (German)."""
    color: Literal["camera", "ooi", "proximity", "height"] = "camera"
    """Colours of ply and glb, as on the page."""
    base_frame: str = "base_link"
    """For the trajectory and mesh of a bag that has no frame `base_link`: the frame of its base,
    such as `base_footprint`."""
    profile: str | None = None
    """For a bag whose topics have names of their own: built-in profile or YAML file whose section
    `ros2` names them, as in `ippon replay`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ask:
    """Ask a running navigator to search for an object, from any terminal that reaches it.

    A photo of it will do as well: `ippon ask --picture mug.jpg --context "in the kitchen"`.
    Several objects are searched for in one tour, `ippon ask "my keys and my wallet"`, or one after
    another, "my keys, then my wallet". `ippon read` shows what is understood of a sentence without
    searching. Of several robots on a router, `ippon ask --nearest "my keys in the kitchen"` asks
    the nearest one that is free.
    """

    object: Positional[str] = ""
    """Object to search for: "hat", or a sentence: "find my hat, I left it on the sofa"."""
    context: str = ""
    """What you know about its place, in plain words."""
    picture: Path | None = None
    """A picture of the object, in place of its name: the navigator's language model, which must
    take images, says what it shows."""
    explain: bool = False
    """Print how near each common object is likely to be, the reason, and the source."""
    show_prompt: bool = False
    """With --explain: also print the exact question to the language model and its answer."""
    yes: bool = False
    """Search without confirmation, even where the reading of a sentence is uncertain; a sentence
    without an object, or in a language that is not understood, starts nothing."""
    add_label: str | None = None
    """Add a kind of common object to recognise from now on, such as "bookcase"; the object to
    search for may then be left out."""
    nearest: bool = False
    """Give it to the robot that is free, has the place in its map (the room that was said, or where
    it remembers the object) and has the shortest way there; says why it is none of the others. It
    takes control from nobody and queues nothing: exit status 1 if no robot is free. All robots on
    the router are asked; that of --robot reads the sentence."""
    confirm: int | Literal["last"] | None = None
    """In place of a search: confirm a find by its number, or the "last" one, which has ended the
    search. `--follow` prints the numbers of several."""
    reject: int | Literal["last"] | None = None
    """Likewise: say that a find is not the object. It does not count, and the search goes on for
    what is missing."""
    goal: int | None = None
    """With --confirm or --reject: number of the goal; in a tour of several each has its finds."""
    follow: bool = False
    """Print what happens until the search ends. Exit status 0: object found; 4: object found, but
    no path leads close to it; 1: ended without a find; 2: not followed to its end, as where the
    navigator is gone."""
    json: bool = False
    """Print one JSON object per line instead of text."""
    connect: str | None = None
    """zenoh endpoint of the navigator; by default the navigator running on this machine."""
    robot: str | None = None
    """Key prefix of the robot; by default that of the navigator running on this machine."""
    take: bool = False
    """Take control from its holder for the duration of the request."""
    timeout_s: float = 5.0
    """Time to wait for a navigator that is not ready yet, and then for its answer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Control:
    """What a robot does now, and Stop, Pause, Resume and Cancel, from any terminal.

    `ippon control` prints what is searched for, what waits and what was found, with the numbers of
    the goals. `ippon control stop` stops the robot at once, whoever has control.
    """

    action: Positional[Literal["show", "stop", "pause", "resume", "cancel"]] = "show"
    """stop: stand still at once until resume, whoever has control; pause: stand still until resume;
    cancel: end the present search, or that of a whole tour."""
    goal: int | None = None
    """With cancel: number of the only goal to end, also of one that waits."""
    json: bool = False
    """Print JSON: the navigator's status, or its answer."""
    connect: str | None = None
    """zenoh endpoint of the navigator; by default the navigator running on this machine."""
    robot: str | None = None
    """Key prefix of the robot; by default that of the navigator running on this machine."""
    take: bool = False
    """Take control from its holder for the duration of the request; stop needs none."""
    timeout_s: float = 5.0
    """Time to wait for the navigator."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Read:
    """What is understood of a sentence, without a robot: objects, attributes, places, counts.

    `ippon read "the red mug next to the sink, not in the kitchen"`; several objects: `ippon read
    "my keys, then two chairs"`; after another request: `ippon read "the other one" --previous "a
    red mug"`. Rules read English; a language model reads any language: `ippon read "wo ist mein
    Hut" --llm.model NAME`. Exit status 1 when no object was understood.
    """

    sentence: Positional[str]
    """What somebody would say to the robot."""
    previous: str = ""
    """The request before, for "the other one" and "the same again"."""
    json: bool = False
    """Print JSON instead of a table: goals, doubtful, because, unused, notes."""
    llm: Llm = field(default_factory=Llm)


@dataclass(frozen=True, slots=True, kw_only=True)
class Memory:
    """Where something is, or was last: from what the robot remembers, without moving it.

    Exit status 0 when something that answers is still there, else 1.
    """

    find: str = ""
    """What, in your own words: "my keys"; without it, everything."""
    json: bool = False
    """Print JSON instead of a table."""
    limit: int = 50
    """Largest number of things."""
    file: Path | None = None
    """Read the memory beside this file of `ippon navigate --map`, without a navigator."""
    picture: Path | None = None
    """Write the picture of the first thing that has one to this JPEG file."""
    connect: str | None = None
    """zenoh endpoint of the navigator; without one, the navigator running on this machine."""
    robot: str | None = None
    """Key prefix of the robot; without one, that of the navigator running on this machine."""
    timeout_s: float = 5.0
    """How long to wait for the navigator."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Levels:
    """Print how near an object is likely to be to each common object, without a robot."""

    object: Positional[str]
    """The object, in your own words."""
    context: str = ""
    """What you know about its place."""
    json: bool = False
    """Print JSON instead of a table."""
    vocabulary: Literal["matterport", "laboratory"] = "matterport"
    """List of common objects to rate."""
    show_prompt: bool = False
    """Also print the exact question to the language model and its answer."""
    llm: Llm = field(default_factory=Llm)


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """Print a robot profile as a template, or check and draw your own.

    `ippon profile > scout.yaml`, edit it, `ippon profile scout.yaml --picture scout.png`, then
    `ippon navigate --profile scout.yaml`. The simulated robot takes it as well. Some robots come
    with the program: `ippon profile spot`. `ippon profile --from-robot ippon > camera.yaml` reads
    the camera of a robot that is connected to a navigator, and asks for the rest.
    """

    profile: Positional[str] = "zed"
    """zed, habitat, anymal-zedx, spot, turtlebot4-oakd, go2-realsense, hand-held, one that another
    package adds, or a YAML file."""
    from_robot: str | None = None
    """Key prefix of a live robot: print its profile, with view and mount of its camera as its
    messages say."""
    connect: str | None = None
    """With --from-robot: zenoh endpoint of its navigator; by default the one on this machine."""
    picture: Path | None = None
    """Draw the body and the field of view, from the side and from above, into this PNG."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Config:
    """Print every configuration field with its default, unit and explanation, or check a file.

    `ippon config > search.yaml`, delete the fields that keep their defaults, edit the rest, then
    `ippon config search.yaml` and `ippon navigate --config search.yaml`.
    """

    file: Positional[Path | None] = None
    """A YAML or JSON file to check; prints the fields that differ from their defaults."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Doctor:
    """Check the installation and the speed of this machine, a live robot, or a recording.

    `ippon doctor --robot scout --profile scout.yaml` listens to the streams of a robot for five
    seconds: rate, delay, clocks, size and unit of the images, depth on colour, tf, commands; each
    line says what to do. `ippon doctor BAG` says the same of a bag, after what its file lacks. Exit
    status 1 where something is missing or wrong.
    """

    recording: Positional[Path | None] = None
    """A recording, or the folder of a session; it is repaired if it was cut off. A damaged one is
    kept beside the repaired one."""
    segmentation: bool = False
    """Measure a segmentation network: images per second."""
    network: Segmentation = field(default_factory=Segmentation)
    """The network; without a checkpoint, SAN is measured with random weights, at equal speed."""
    licences: bool = False
    """List the installed packages instead: licence, size, and what each is for."""
    json: bool = False
    """Print JSON instead of a table."""
    robot: str | None = None
    """Key prefix of the robot to listen to."""
    connect: str | None = None
    """zenoh endpoint of its navigator; by default the navigator running on this machine."""
    profile: str | None = None
    """Built-in profile or YAML file to compare the robot's camera with; for a recording, the one
    whose section `ros2` names its topics, as in `ippon replay`."""
    base_frame: str = "base_link"
    """For a bag that has no frame `base_link`: the frame of its base, such as `base_footprint`, as
    in `ippon replay`."""


Tool = User | Export | Ask | Control | Read | Memory | Levels | Profile | Config | Doctor
