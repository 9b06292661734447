"""Settings of a recomputation: those of the recorded session with changes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import msgspec

from app.configuration import ConfigurationError, changed, parse_changes
from app.messages.status import LevelTable
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
    """Settings of a recomputation."""

    navigator: NavigatorConfig
    levels: dict[str, Level]
    """Levels that replace the recorded ones, by label."""

    def levels_of(self, table: LevelTable) -> dict[str, Level]:
        """Return the level of every label of a recorded table."""
        recorded = {row.label: Level.parse(row.level) for row in table.rows}
        return {label: self.levels.get(label, level) for label, level in recorded.items()}


def read_settings(recording: Recording, changes: Sequence[str]) -> Settings:
    """Return the settings of a session with changes.

    Args:
        recording: A recording with its configuration.
        changes: `NAME=VALUE`: a name of the configuration (`map.voxel_size_m`, `seed`), or
            `guidance.levels.LABEL`.

    Raises:
        RecordingError: The configuration is missing, or a name or value is invalid.
    """
    packed = recording.attachment(CONFIGURATION)
    if packed is None:
        raise RecordingError(
            f"{recording.path} has no configuration of a navigator: only sessions recorded by "
            f"ippon can be recomputed"
        )
    try:
        config = msgspec.json.decode(packed, type=NavigatorConfig)
    except (msgspec.DecodeError, msgspec.ValidationError, ValueError) as error:
        raise RecordingError(
            f"the configuration in {recording.path} is of another version: {error}"
        ) from error
    levels: dict[str, Level] = {}
    fields: list[str] = []
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
                f"{name} has no effect: a recomputation limits the planner's evaluations, not "
                f"its time"
            )
        else:
            fields.append(change)
    try:
        navigator = changed(config, parse_changes(config, fields, group=MISSION))
    except ConfigurationError as error:
        raise RecordingError(f"the changed configuration is refused: {error}") from error
    return Settings(navigator=navigator, levels=levels)


def _level(name: str, text: str, labels: tuple[str, ...]) -> tuple[str, Level]:
    label = canonical_label(name)
    if label not in labels:
        raise RecordingError(f"unknown label {name!r}; there are {', '.join(labels)}")
    try:
        return label, Level.parse(text)
    except ValueError as error:
        raise RecordingError(str(error)) from error
