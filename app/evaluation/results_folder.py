"""The folder of an evaluation: one file per row, the settings, and all rows as JSON Lines."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, cast

from app.evaluation.errors import EvaluationError
from app.homes import home_key
from ippon.atomic_file import replace_file
from ippon.evaluation.episode_generation import home_file_name
from ippon.evaluation.row import EpisodeRow, row_from, values_of

RUN_FILE = "run.json"
TABLE_FILE = "episodes.jsonl"
SESSIONS = "sessions"
"""Folder of recorded episodes."""


_USUAL: Final = {
    "segmentation_errors": "'paper'",
    "mission": "the defaults",
    "attribute_error_rate": "none, without --attributes",
}
"""Settings that are stored only where they are different."""


class EvaluationFolder:
    """Folder of results. Rows are written atomically: a killed run loses unfinished work only."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._rows = path / "rows"
        self._errors = path / "errors"

    def check_homes(self, homes: Sequence[str]) -> None:
        """Refuse homes with the same name as each other or as a home in the folder.

        A home is named by the last part of its path, so that rows and samples do not depend on its
        location.

        Args:
            homes: Seeds and folders, without duplicates.

        Raises:
            EvaluationError: Two homes have one name.
        """
        there = dict.fromkeys(row.home for row in self._rows_by_file())
        known: dict[str, str] = {}
        for home in (*there, *homes):
            first = known.setdefault(home_file_name(home), home)
            if home_key(first) == home_key(home):
                continue
            if first in there:
                raise EvaluationError(
                    f"{self.path} holds rows of {first}, and {home} has the same name; use another "
                    "folder for --out, rename the home's folder, or, if it is the one that was "
                    f"there, make {first} a link to it"
                )
            raise EvaluationError(
                f"{first} and {home} have the same name, so that their rows would overwrite each "
                "other; rename one of the folders, or use a run and a folder for --out for each"
            )

    def open_for(self, settings: dict[str, Any]) -> None:
        """Create the folder, or continue one with the same settings.

        Args:
            settings: "fixed" must be the same in every run of a folder; the rest is stored, with
                the "configurations" of methods of earlier runs.

        Raises:
            EvaluationError: The folder cannot be written, or holds other results.
        """
        run = self.path / RUN_FILE
        try:
            self._rows.mkdir(parents=True, exist_ok=True)
            self._errors.mkdir(exist_ok=True)
            if run.is_file():
                old = _read_settings(run)
                self._check_same(old, settings)
                settings = _with_configurations_of(old, settings)
            replace_file(run, json.dumps(settings, indent=1, sort_keys=True).encode())
        except OSError as error:
            raise EvaluationError(f"cannot write to {self.path}: {error}") from error
        except ValueError as error:
            raise EvaluationError(f"{run} is damaged: {error}; use another folder") from error

    def _check_same(self, old: dict[str, Any], new: dict[str, Any]) -> None:
        odd = differing_settings(old, new)
        if odd:
            listed = ", ".join(f"{key} {before} (now {now})" for key, before, now in odd)
            how, or_else = "holds results of", ""
            if not self.has_rows():
                how, or_else = "was begun, without results yet, with", ", or delete it"
            raise EvaluationError(
                f"{self.path} {how} another setup: {listed}; use another folder for --out, or the "
                f"same options{or_else}"
            )
        kept = old.get("configurations", {})
        for method, configuration in new.get("configurations", {}).items():
            made_with = kept.get(method, {}).get("hash", configuration["hash"])
            if made_with != configuration["hash"] and any(self._rows.glob(f"*.{method}.json")):
                raise EvaluationError(
                    f"{self.path} holds rows of {method} with configuration {made_with}, this "
                    f"would be {configuration['hash']}; use another folder for --out"
                )

    def has(self, episode_id: str, method: str, config_hash: str, context: str) -> bool:
        """Return whether a row exists.

        Raises:
            EvaluationError: The row has another configuration, or another context.
        """
        path = self._row_file(episode_id, method)
        if not path.is_file():
            return False
        row = _read_row(path)
        for what, before, now in (
            ("configuration", row.config_hash, config_hash),
            ("context", repr(row.context), repr(context)),
        ):
            if before != now:
                raise EvaluationError(
                    f"{path} was made with {what} {before}, this would be {now}; use another "
                    "folder for --out"
                )
        return True

    def write(self, row: EpisodeRow) -> None:
        """Add a row, and remove an earlier error of the same episode.

        Raises:
            EvaluationError: The row cannot be written; those that are there stay.
        """
        self._replace(self._row_file(row.episode_id, row.method), _line(row))
        self.forget_error(f"{row.episode_id}.{row.method}")

    def write_error(self, name: str, text: str) -> None:
        """Store the error of an episode or a home; raises EvaluationError if it cannot."""
        self._replace(self._errors / f"{_fit_for_a_file(name)}.txt", text)

    def forget_error(self, name: str) -> None:
        """Remove the error of an episode or a home."""
        (self._errors / f"{_fit_for_a_file(name)}.txt").unlink(missing_ok=True)

    def has_rows(self) -> bool:
        """Return whether the folder has any row."""
        return any(self._rows.glob("*.json"))

    def errors(self) -> tuple[str, ...]:
        """Return the names of episodes that failed with an error."""
        if not self._errors.is_dir():
            return ()
        return tuple(sorted(p.stem for p in self._errors.glob("*.txt")))

    def rows(self) -> tuple[EpisodeRow, ...]:
        """Return every row, ordered by method and episode.

        Raises:
            EvaluationError: The folder holds no results, or damaged ones.
        """
        rows = self._rows_by_file()
        if rows:
            return rows
        table = self.path / TABLE_FILE
        if not table.is_file():
            failed = len(self.errors())
            if failed:
                raise EvaluationError(
                    f"{self.path} holds no results: {failed} episodes ended with an error; see "
                    f"{self._errors}"
                )
            raise EvaluationError(
                f"{self.path} holds no results; make some with `ippon eval run --out {self.path}`"
            )
        try:
            lines = table.read_text(encoding="utf-8").splitlines()
            return tuple(row_from(json.loads(line)) for line in lines)
        except (OSError, ValueError, TypeError) as error:
            raise EvaluationError(f"{table} is damaged: {error}") from error

    def settings(self) -> dict[str, Any]:
        """Return the settings of the folder, empty if unknown.

        Raises:
            EvaluationError: Their file is damaged.
        """
        run = self.path / RUN_FILE
        try:
            return _read_settings(run) if run.is_file() else {}
        except (OSError, ValueError) as error:
            raise EvaluationError(
                f"{run} is damaged: {error}; delete it to continue without settings"
            ) from error

    def merge(self) -> int:
        """Write all rows into one file, a line each; return their number."""
        rows = self.rows()
        lines = (f"{_line(row)}\n" for row in rows)
        self._replace(self.path / TABLE_FILE, "".join(lines))
        return len(rows)

    def _replace(self, path: Path, text: str) -> None:
        try:
            replace_file(path, text.encode())
        except OSError as error:
            raise EvaluationError(
                f"cannot write {path}: {error.strerror}; finished episodes are kept: start again "
                f"with --out {self.path}"
            ) from error

    def _rows_by_file(self) -> tuple[EpisodeRow, ...]:
        files = sorted(self._rows.glob("*.json")) if self._rows.is_dir() else []
        return tuple(_read_row(path) for path in files)

    def _row_file(self, episode_id: str, method: str) -> Path:
        return self._rows / f"{episode_id}.{method}.json"


def differing_settings(old: dict[str, Any], new: dict[str, Any]) -> list[tuple[str, str, str]]:
    """Return the names of the fixed settings that differ, each with both values.

    Settings that a folder does not have because they are usual are named by their usual value.
    """
    before, now = old.get("fixed", {}), new.get("fixed", {})
    return [
        (key, _named(key, before), _named(key, now))
        for key in sorted({*before, *now})
        if before.get(key) != now.get(key)
    ]


def _named(key: str, fixed: dict[str, Any]) -> str:
    return repr(fixed[key]) if key in fixed else _USUAL.get(key, "unknown")


def _read_settings(run: Path) -> dict[str, Any]:
    """Read the settings of a folder; raises OSError and ValueError."""
    settings = json.loads(run.read_text(encoding="utf-8"))
    if not isinstance(settings, dict):
        raise ValueError(f"it holds a {type(settings).__name__}, and no settings")  # noqa: TRY004
    return cast("dict[str, Any]", settings)


def _with_configurations_of(old: dict[str, Any], new: dict[str, Any]) -> dict[str, Any]:
    """Return settings with the configurations of methods of earlier runs."""
    kept = {**old.get("configurations", {}), **new.get("configurations", {})}
    return {**new, "configurations": kept} if kept else new


def _fit_for_a_file(name: str) -> str:
    return "".join(c if c.isalnum() or c in "_-. " else "_" for c in name)


def _line(row: EpisodeRow) -> str:
    return json.dumps(values_of(row))


def _read_row(path: Path) -> EpisodeRow:
    try:
        return row_from(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError) as error:
        raise EvaluationError(
            f"{path} is damaged or of another version: {error}; delete it to run that search again"
        ) from error
