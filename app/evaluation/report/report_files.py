"""Reading and writing of an evaluation's report."""

import dataclasses
import json
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


def read_report_data(path: Path, reference: str = REFERENCE) -> ReportData:
    """Return means, intervals and paired tests of a folder's rows.

    Args:
        path: The folder.
        reference: Method that the others are compared with.

    Raises:
        EvaluationError: The folder holds no results, damaged ones, or none of the reference.
    """
    folder = EvaluationFolder(path)
    rows = folder.rows()
    alone = singles(rows)
    names = sorted({row.method for row in alone})
    if reference != REFERENCE and reference not in names:
        raise EvaluationError(f"{path} has no rows of {reference}; there are {', '.join(names)}")
    return ReportData(
        rows=alone,
        summaries=summarise(alone),
        comparisons=compare(alone, reference),
        reference=reference,
        later=[row for row in rows if row.kind != "single"],
        contexts=context_effects(rows),
        seconds=second_object_effects(rows),
        errors=folder.errors(),
        settings=folder.settings(),
        folder=path,
    )


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
        "settings": data.settings,
    }
