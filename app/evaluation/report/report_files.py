"""Reading and writing of an evaluation's report."""

import csv
import dataclasses
import io
import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from app.evaluation.errors import EvaluationError
from app.evaluation.report.report_data import ReportData
from app.evaluation.report.report_page import report_page
from app.evaluation.results_folder import EvaluationFolder, differing_settings
from ippon.atomic_file import replace_file
from ippon.evaluation.methods.rule_share import unruled_shares
from ippon.evaluation.row import PATH_COLUMNS, EpisodeRow, values_of
from ippon.evaluation.summary import (
    REFERENCE,
    compare,
    context_effects,
    losses,
    parts,
    second_object_effects,
    singles,
    summarise,
)


def read_report_data(
    path: Path,
    reference: str = REFERENCE,
    against: Sequence[Path] = (),
    pool: Sequence[Path] = (),
) -> ReportData:
    """Return means, intervals and paired tests of a folder's rows.

    Args:
        path: The folder.
        reference: Method that the others are compared with.
        against: Folders whose methods are compared, too.
        pool: Folders whose rows are added to those of the first.

    Raises:
        EvaluationError: A folder holds no results, or damaged ones, or two have one name, or none
            holds the reference, or two that are pooled hold the same search.
    """
    folder, *others = _distinct(path, (*pool, *against))
    pooled = [folder, *others[: len(pool)]]
    rows, folders = _pooled(pooled)
    alone = singles(rows)
    compared, other_settings = list(alone), list[str]()
    for other in others[: len(pool)]:
        name = other.path.resolve().name
        other_settings += _differences(folder.settings(), other.settings(), name)
    for other in others[len(pool) :]:
        name = other.path.resolve().name
        compared += [
            dataclasses.replace(row, method=f"{row.method} ({name})")
            for row in singles(other.rows())
        ]
        other_settings += _differences(folder.settings(), other.settings(), name)
    names = sorted({row.method for row in compared})
    if reference != REFERENCE and reference not in names:
        raise EvaluationError(f"{path} has no rows of {reference}; there are {', '.join(names)}")
    return ReportData(
        rows=alone,
        folders=folders,
        compared=compared,
        other_settings=other_settings,
        summaries=summarise(compared),
        parts=parts(compared),
        losses=losses(compared),
        comparisons=compare(compared, reference),
        reference=reference,
        later=[row for row in rows if row.kind != "single"],
        contexts=context_effects(rows),
        seconds=second_object_effects(rows),
        unruled=unruled_shares(compared),
        errors=[error for one in pooled for error in one.errors()],
        settings=folder.settings(),
        folder=path,
    )


def _distinct(path: Path, against: Sequence[Path]) -> list[EvaluationFolder]:
    """Return all folders; each is told by the last part of its path."""
    names = Counter(folder.resolve().name for folder in (path, *against))
    twice = [name for name, count in names.items() if count > 1]
    if twice:
        raise EvaluationError(f"two folders are called {twice[0]}; rename one of them")
    return [EvaluationFolder(folder) for folder in (path, *against)]


def _pooled(
    pooled: Sequence[EvaluationFolder],
) -> tuple[list[EpisodeRow], dict[tuple[str, str], Path]]:
    """Return the rows of some folders, and the folder of each by episode and method."""
    rows: list[EpisodeRow] = []
    folders: dict[tuple[str, str], Path] = {}
    for folder in pooled:
        for row in folder.rows():
            key = row.episode_id, row.method
            if key in folders:
                raise EvaluationError(
                    f"{folders[key]} and {folder.path} both hold {row.episode_id} by {row.method}; "
                    "only different searches can be pooled"
                )
            folders[key] = folder.path
            rows.append(row)
    return rows, folders


def _differences(settings: dict[str, Any], other: dict[str, Any], name: str) -> list[str]:
    return [
        f"{key} is {ours}, in {name} {theirs}"
        for key, ours, theirs in differing_settings(settings, other)
    ]


def write_report(data: ReportData) -> Path:
    """Write report.html, report.json and episodes.csv beside the rows; return the page's path.

    Raises:
        EvaluationError: The folder cannot be written.
    """
    page, table = data.folder / "report.html", data.folder / "report.json"
    try:
        replace_file(page, report_page(data).encode())
        replace_file(data.folder / "episodes.csv", _as_csv([*data.compared, *data.later]).encode())
        replace_file(table, json.dumps(_as_json(data), indent=1).encode())
    except OSError as error:
        raise EvaluationError(f"cannot write to {data.folder}: {error}") from error
    return page


def _as_csv(rows: Sequence[EpisodeRow]) -> str:
    """Return a line for each search, without its path; empty where there is no value."""
    names = [f.name for f in dataclasses.fields(EpisodeRow) if f.name not in PATH_COLUMNS]
    text = io.StringIO()
    writer = csv.DictWriter(text, names, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    writer.writerows(values_of(row) for row in rows)
    return text.getvalue()


def _as_json(data: ReportData) -> dict[str, Any]:
    return {
        "methods": [dataclasses.asdict(s) for s in data.summaries],
        "parts": [dataclasses.asdict(p) for p in data.parts],
        "losses": [dataclasses.asdict(one) for one in data.losses],
        "comparisons": [dataclasses.asdict(c) for c in data.comparisons],
        "contexts": [dataclasses.asdict(c) for c in data.contexts],
        "second_objects": [dataclasses.asdict(s) for s in data.seconds],
        "errors": list(data.errors),
        "other_settings": list(data.other_settings),
        "settings": data.settings,
    }
