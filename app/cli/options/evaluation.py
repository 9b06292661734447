"""Options of `ippon eval`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro
from tyro.conf import Positional

from app.evaluation.config import EvaluationConfig


@dataclass(frozen=True, slots=True, kw_only=True)
class EvalRun(EvaluationConfig):
    """Search for many objects in many simulated homes, with one method or several.

    Writes one row per episode into a folder. Started again with the same folder, also after a
    kill, it continues with the episodes that are missing.
    """

    config: Path | None = None
    """Configuration file, YAML or JSON: its `mission` replaces defaults of the searches; `ippon
    config` prints the fields. A flag that is given wins over the file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EvalReport:
    """Table, intervals, paired tests and plots of a folder that `ippon eval run` wrote."""

    folder: Positional[Path]
    """The folder."""
    json: bool = False
    """Print the table as JSON."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EvalReplay:
    """Run one episode of an evaluation again, and record it for `ippon review`.

    The same version of the program gives the same search. Prints the recording's folder.
    """

    folder: Positional[Path]
    """The folder that `ippon eval run` wrote."""
    episode: Positional[str]
    """The episode's name, for example 1003.hat.3.untold; the report lists them."""
    method: str = "ippon"
    """By which method."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EvalHabitat:
    """Search in habitat-lab's environment, for example HM3D; see docs/guides/habitat.md."""

    config: Positional[Path]
    """habitat's YAML of the benchmark, with the challenge's sensors and velocity actions."""
    python: Path
    """Interpreter of the environment that has habitat-sim and habitat-lab."""
    out: Path = Path("habitat.jsonl")
    """One JSON object an episode."""
    segmentation: Literal["san", "clipseg", "owlv2"] = "san"
    """The network that sees."""
    checkpoints: Path = Path("checkpoints")
    """Folder of checkpoints that are given by name."""
    episodes: int | None = None
    """At most so many."""
    overrides: tuple[str, ...] = ()
    """Changes to habitat's configuration, such as habitat.dataset.split=val."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Eval:
    """Measure how efficiently methods search, and report it."""

    command: (
        Annotated[EvalRun, tyro.conf.subcommand("run")]
        | Annotated[EvalReport, tyro.conf.subcommand("report")]
        | Annotated[EvalReplay, tyro.conf.subcommand("replay")]
        | Annotated[EvalHabitat, tyro.conf.subcommand("habitat")]
    )
