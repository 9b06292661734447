"""Reading and writing of an evaluation's report."""

import dataclasses
import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from app.evaluation.errors import EvaluationError
from app.evaluation.report.report_data import ReportData
from app.evaluation.report.report_page import report_page
from app.evaluation.results_folder import EvaluationFolder
from ippon.evaluation.summary import (
    REFERENCE,
    compare,
    context_effects,
    second_object_effects,
    singles,
    summarise,
)


def read_report_data(
    path: Path, reference: str = REFERENCE, against: Sequence[Path] = ()
) -> ReportData:
    """Return means, intervals and paired tests of a folder's rows.

    Args:
        path: The folder.
        reference: Method that the others are compared with.
        against: Folders whose methods are compared, too.

    Raises:
        EvaluationError: A folder holds no results, or damaged ones, or two have one name, or none
            holds the reference.
    """
    folder = EvaluationFolder(path)
    rows = folder.rows()
    alone = singles(rows)
    compared, other_settings = list(alone), list[str]()
    for other in _distinct(path, against):
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
        compared=compared,
        other_settings=other_settings,
        summaries=summarise(compared),
        comparisons=compare(compared, reference),
        reference=reference,
        later=[row for row in rows if row.kind != "single"],
        contexts=context_effects(rows),
        seconds=second_object_effects(rows),
        errors=folder.errors(),
        settings=folder.settings(),
        folder=path,
    )


def _distinct(path: Path, against: Sequence[Path]) -> list[EvaluationFolder]:
    """Return the other folders; each is told by the last part of its path."""
    names = Counter(folder.resolve().name for folder in (path, *against))
    twice = [name for name, count in names.items() if count > 1]
    if twice:
        raise EvaluationError(f"two folders are called {twice[0]}; rename one of them")
    return [EvaluationFolder(folder) for folder in against]


def _differences(settings: dict[str, Any], other: dict[str, Any], name: str) -> list[str]:
    ours, theirs = settings.get("fixed", {}), other.get("fixed", {})
    return [
        f"{key} is {ours.get(key)!r}, in {name} {theirs.get(key)!r}"
        for key in sorted({*ours, *theirs})
        if ours.get(key) != theirs.get(key)
    ]


def write_report(data: ReportData) -> Path:
    """Write report.html and report.json beside the rows; return the page's path.

    Raises:
        EvaluationError: The folder cannot be written.
    """
    page, table = data.folder / "report.html", data.folder / "report.json"
    try:
        page.write_text(report_page(data), encoding="utf-8")
        table.write_text(json.dumps(_as_json(data), indent=1), encoding="utf-8")
    except OSError as error:
        raise EvaluationError(f"cannot write to {data.folder}: {error}") from error
    return page


def _as_json(data: ReportData) -> dict[str, Any]:
    return {
        "methods": [dataclasses.asdict(s) for s in data.summaries],
        "comparisons": [dataclasses.asdict(c) for c in data.comparisons],
        "contexts": [dataclasses.asdict(c) for c in data.contexts],
        "second_objects": [dataclasses.asdict(s) for s in data.seconds],
        "errors": list(data.errors),
        "other_settings": list(data.other_settings),
        "settings": data.settings,
    }
