"""Settings of a recorded session with some of them changed, for a recomputation."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import msgspec
import yaml

from app.messages.control import LevelTable
from app.nodes.navigator.config import NavigatorConfig
from app.recording.errors import RecordingError
from app.recording.reading.recording import Recording
from app.recording.writing.session import CONFIGURATION
from ippon.guidance.levels import Level
from ippon.vocabulary import canonical_label

LEVELS: Final = "guidance.levels."
MISSION: Final = "mission"
STEP_BUDGET: Final = "planner.step_budget_s"


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """What a recomputation uses."""

    navigator: NavigatorConfig
    levels: dict[str, Level]
    """Levels that take the place of the recorded ones, by label."""

    def levels_of(self, table: LevelTable) -> dict[str, Level]:
        """Return the level of every label of a recorded table."""
        recorded = {row.label: Level.parse(row.level) for row in table.rows}
        return {label: self.levels.get(label, level) for label, level in recorded.items()}


def read_settings(recording: Recording, changes: Sequence[str]) -> Settings:
    """Return the settings that a session was recorded with, changed.

    Args:
        recording: With its configuration.
        changes: `NAME=VALUE`: a name of the configuration (`map.voxel_size_m`, `seed`), or
            `guidance.levels.LABEL`.

    Raises:
        RecordingError: There is no configuration, a name that it does not have, or a value that it
            does not take.
    """
    packed = recording.attachment(CONFIGURATION)
    if packed is None:
        raise RecordingError(
            f"{recording.path} holds no configuration of a navigator: only sessions that ippon "
            "recorded can be recomputed"
        )
    try:
        tree: dict[str, Any] = msgspec.json.decode(packed)
        config = msgspec.convert(tree, NavigatorConfig)
    except (msgspec.DecodeError, msgspec.ValidationError, ValueError) as error:
        raise RecordingError(
            f"the configuration in {recording.path} is of another version: {error}"
        ) from error
    levels: dict[str, Level] = {}
    for change in changes:
        name, equals, text = change.partition("=")
        if not equals:
            raise RecordingError(
                f"a change is NAME=VALUE, like map.voxel_size_m=0.05; got {change!r}"
            )
        if name.startswith(LEVELS):
            label, level = _level(name.removeprefix(LEVELS), text, config.labels)
            levels[label] = level
        elif name.endswith(STEP_BUDGET):
            raise RecordingError(
                f"{name} changes nothing here: a recomputation counts the planner's work and keeps "
                "no time"
            )
        else:
            _set(tree, name, yaml.safe_load(text))
    try:
        changed = msgspec.convert(tree, NavigatorConfig)
    except (msgspec.ValidationError, ValueError) as error:
        raise RecordingError(f"the changed configuration is refused: {error}") from error
    return Settings(navigator=changed, levels=levels)


def _level(name: str, text: str, labels: tuple[str, ...]) -> tuple[str, Level]:
    label = canonical_label(name)
    if label not in labels:
        raise RecordingError(f"there is no label {name!r}; there are {', '.join(labels)}")
    try:
        return label, Level.parse(text)
    except ValueError as error:
        raise RecordingError(str(error)) from error


def _set(tree: dict[str, Any], name: str, value: Any) -> None:
    """Set one value; names of the mission need no `mission.` before them."""
    parts = name.split(".")
    if parts[0] not in tree and parts[0] in tree[MISSION]:
        parts = [MISSION, *parts]
    node: Any = tree
    for depth, part in enumerate(parts):
        if not isinstance(node, dict) or part not in node:
            there = (
                ", ".join(sorted(map(str, node))) if isinstance(node, dict) else "no names below"
            )
            above = ".".join(parts[:depth]) or "the configuration"
            raise RecordingError(f"there is no {part!r} in {above}; there is {there}")
        if depth == len(parts) - 1:
            node[part] = value
        node = node[part]
