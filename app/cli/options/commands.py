"""All commands of `ippon` by name."""

from typing import Annotated, Any, Final, get_args

from tyro.conf import subcommand

from app.cli.options.certificates import Certificates
from app.cli.options.evaluation import Eval
from app.cli.options.nodes import (
    Console,
    Demo,
    Navigate,
    Record,
    Replay,
    Review,
    Segment,
    Sim,
)
from app.cli.options.recognition import Calibrate, Recognise
from app.cli.options.ros2 import Ros2
from app.cli.options.tools import (
    Ask,
    Config,
    Control,
    Doctor,
    Export,
    Levels,
    Memory,
    Profile,
    Read,
    User,
)
from app.cli.options.viewers import Foxglove, Rerun

Command = (
    Annotated[Demo, subcommand("demo")]
    | Annotated[Sim, subcommand("sim")]
    | Annotated[Navigate, subcommand("navigate")]
    | Annotated[Segment, subcommand("segment")]
    | Annotated[Console, subcommand("console")]
    | Annotated[User, subcommand("user")]
    | Annotated[Record, subcommand("record")]
    | Annotated[Review, subcommand("review")]
    | Annotated[Export, subcommand("export")]
    | Annotated[Replay, subcommand("replay")]
    | Annotated[Foxglove, subcommand("foxglove")]
    | Annotated[Rerun, subcommand("rerun")]
    | Annotated[Recognise, subcommand("recognise")]
    | Annotated[Calibrate, subcommand("calibrate")]
    | Annotated[Ask, subcommand("ask")]
    | Annotated[Control, subcommand("control")]
    | Annotated[Read, subcommand("read")]
    | Annotated[Memory, subcommand("memory")]
    | Annotated[Levels, subcommand("levels")]
    | Annotated[Eval, subcommand("eval")]
    | Annotated[Ros2, subcommand("ros2")]
    | Annotated[Profile, subcommand("profile")]
    | Annotated[Certificates, subcommand("certificates")]
    | Annotated[Config, subcommand("config")]
    | Annotated[Doctor, subcommand("doctor")]
)

BY_NAME: Final[dict[str, Any]] = {
    one.__metadata__[0].name: one.__origin__ for one in get_args(Command)
}
"""The options of each command."""
