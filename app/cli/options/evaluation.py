"""Options of `ippon eval`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro
from tyro.conf import Positional

from app.evaluation.config import EvaluationConfig


@dataclass(frozen=True, slots=True, kw_only=True)
class EvalRun(EvaluationConfig):
    """Search for many objects in many simulated homes, with one or several methods.

    Writes one row per episode into a folder. A restart with the same folder runs only the missing
    episodes.
    """

    config: Path | None = None
    """Configuration file, YAML or JSON, of which `mission` applies to the searches; `ippon config`
    prints the fields. Flags override the file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EvalReport:
    """Report a folder of `ippon eval run`: table, intervals, paired tests and plots."""

    folder: Positional[Path]
    """Folder that `ippon eval run` wrote."""
    reference: str = "ippon"
    """Method that the others are compared with, episode by episode."""
    pool: tuple[Path, ...] = ()
    """Folders of further runs, whose episodes count as if they were in the same folder."""
    against: tuple[Path, ...] = ()
    """Folders of other runs, such as that before a change, whose methods are compared on the same
    episodes; they are named with their folder, as in "ippon (before)"."""
    json: bool = False
    """Print the table as JSON."""
    detail: bool = False
    """Print also the figures by shortest path and by kind of object, why searches failed, and where
    SPL is lost; report.html and report.json always have them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EvalReplay:
    """Run one episode of an evaluation again and record it for `ippon review`.

    The same version of the program repeats the search exactly. Prints the recording's folder.
    """

    folder: Positional[Path]
    """The folder that `ippon eval run` wrote."""
    episode: Positional[str]
    """Name of the episode, for example 1003.hat.3.untold; the report lists the names."""
    method: str = "ippon"
    """Method of the row."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EvalHabitat:
    """Search in habitat-lab's environment, for example on HM3D; see docs/guides/habitat.md."""

    config: Positional[Path]
    """habitat-lab's YAML of the benchmark, with the challenge's sensors and velocity actions."""
    python: Path
    """Python interpreter of the environment with habitat-sim and habitat-lab."""
    out: Path = Path("habitat.jsonl")
    """File for one JSON object per episode; one that is there gets another name."""
    segmentation: Literal["san", "clipseg", "owlv2"] = "san"
    """Segmentation network."""
    checkpoints: Path = Path("checkpoints")
    """Folder of the checkpoints."""
    episodes: int | None = None
    """Maximum number of episodes."""
    overrides: tuple[str, ...] = ()
    """Overrides of habitat's configuration, such as habitat.dataset.split=val."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Eval:
    """Measure and report how efficiently methods search."""

    command: (
        Annotated[EvalRun, tyro.conf.subcommand("run")]
        | Annotated[EvalReport, tyro.conf.subcommand("report")]
        | Annotated[EvalReplay, tyro.conf.subcommand("replay")]
        | Annotated[EvalHabitat, tyro.conf.subcommand("habitat")]
    )
