"""`ippon eval report`: prints the table as text or JSON, and writes the page."""

import json
import sys
from collections.abc import Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from app.cli.options.evaluation import EvalReport
from app.evaluation.report.report_data import ReportData
from app.evaluation.report.report_files import read_report_data, write_report
from app.evaluation.report.report_tables import losses_in_order
from app.evaluation.report.report_warnings import warnings_of
from ippon.evaluation.statistics import PairedDifference, Ratio
from ippon.evaluation.summary import Effect, MethodSummary


def run_eval_report(command: EvalReport) -> int:
    """Print the table; write report.html, report.json and episodes.csv beside the rows."""
    data = read_report_data(command.folder, command.reference, command.against, command.pool)
    if command.json:
        print(json.dumps([json_line(s) for s in data.summaries], indent=1))
    else:
        screen = Console()
        _print_tables(screen, data)
        if command.detail:
            _print_detail(screen, data)
        _print_effects(screen, "a correct sentence (with, without)", data.contexts)
        _print_effects(screen, "a known home (second object with and without map)", data.seconds)
    for text, minor in warnings_of(data):
        if not minor:
            print(f"ippon: {text}", file=sys.stderr)
    for name in data.errors:
        print(f"ippon: {name} ended with an error and is not counted", file=sys.stderr)
    # Last, so that the figures are shown of a folder that cannot be written.
    page = write_report(data)
    if not command.json:
        print(f"\n{page}")
    return 0


def json_line(s: MethodSummary) -> dict[str, Any]:
    """Return the `--json` line of one method."""
    return {
        "method": s.method,
        "episodes": s.episodes,
        "success": round(s.success, 4),
        "spl": round(s.spl, 4),
        "soft_spl": round(s.soft_spl, 4),
        "spl_ci95": None if s.spl_ci95 is None else [round(v, 4) for v in s.spl_ci95],
        "find_s": None if s.find_s is None else round(s.find_s, 1),
        "hits": round(s.hits, 4),
        "planner_ms_p95": round(s.planner_ms_p95, 2),
        "realtime_factor": round(s.realtime_factor, 2),
    }


def _print_tables(screen: Console, data: ReportData) -> None:
    summaries, comparisons = data.summaries, data.comparisons
    heads = ("method", "n", "succ", "SPL", "95 %", "find", "hits", "ms", "×")
    table = _table("means over episodes, 95 % intervals over homes", heads)
    for s in summaries:
        table.add_row(
            s.method,
            str(s.episodes),
            f"{s.success:.2f}",
            f"{s.spl:.3f}",
            "-" if s.spl_ci95 is None else "{:.2f}-{:.2f}".format(*s.spl_ci95),
            "-" if s.find_s is None else f"{s.find_s:.0f}",
            f"{s.hits:.2f}",
            f"{s.planner_ms_p95:.0f}",
            f"{s.realtime_factor:.1f}",
        )
    screen.print(table)
    screen.print(
        "find: median s to the find, a failure counting as never; ms: planner step, 95th "
        "percentile; ×: simulated over processor time",
        style="dim",
    )
    for text, minor in warnings_of(data):
        if minor:
            screen.print(text, style="dim", highlight=False)
    if not comparisons:
        if len(summaries) > 1:
            screen.print(f"no method shares episodes with {data.reference}: see --reference")
        return
    heads = ("method", "n", "SPL", "95 %", "p", "ratio", "succ", "time")
    pairs = _table(f"{data.reference} less each, on the same episodes", heads)
    for c in comparisons:
        pairs.add_row(
            c.method,
            str(c.spl.pairs),
            f"{c.spl.mean:+.3f}",
            _interval(c.spl),
            f"{c.spl.p:.3f}",
            _ratio(c.spl_ratio),
            f"{c.success.mean:+.2f}",
            _ratio(c.find_s_ratio),
        )
    screen.print(pairs)
    screen.print(
        f"SPL: {data.reference} minus the method; 95 %: interval of that difference, over homes; "
        "p: probability of one as large if the two were equal, by flipping the signs of homes; "
        f"ratio: SPL of {data.reference} over the method's; time: of the method's finds over those "
        f"of {data.reference}, where both succeed; --detail has the ratios' intervals",
        style="dim",
    )


def _print_detail(screen: Console, data: ReportData) -> None:
    table = _table("by shortest path and by object", ("method", "with", "n", "succ", "SPL"))
    for p in sorted(data.parts, key=lambda p: p.method):
        table.add_row(p.method, p.name, str(p.episodes), f"{p.success:.2f}", f"{p.spl:.3f}")
    screen.print(table)
    if data.comparisons:
        heads = ("method", "n", "SPL", "s.e.", "ratio", "95 %", "time", "95 %")
        table = _table(f"{data.reference} against each: standard error and ratios", heads)
        for c in data.comparisons:
            error = c.spl.standard_error
            table.add_row(
                c.method,
                str(c.spl.pairs),
                f"{c.spl.mean:+.3f}",
                "-" if error is None else f"{error:.3f}",
                _ratio(c.spl_ratio),
                _ratio_interval(c.spl_ratio),
                _ratio(c.find_s_ratio),
                _ratio_interval(c.find_s_ratio),
            )
        screen.print(table)
    table = _table("why searches failed", ("method", "cause", "n", "given up"))
    for s in data.summaries:
        for cause, count in s.failures.items():
            given_up = s.given_up.get(cause, 0)
            table.add_row(s.method, cause.replace("_", " "), str(count), str(given_up))
    if table.row_count:
        screen.print(table)
        screen.print("given up: before its time, with nothing left to look at", style="dim")
    if not data.losses:
        screen.print("rows of an earlier version do not say where SPL was lost")
        return
    heads = ("method", "n", "view", "map", "reach", "stop", "false", "other")
    table = _table("where SPL is lost, of 1", heads)
    for one in data.losses:
        figures = (f"{x:.3f}" for x in losses_in_order(one))
        table.add_row(one.method, str(one.episodes), *figures)
    screen.print(table)
    screen.print(
        "view: before the object first came into view; map: from there until it was in the map; "
        "reach: until a stop would have counted; stop: until the stop; false, other: what false "
        "stops and other failures could still have had",
        style="dim",
    )


def _print_effects(screen: Console, what: str, effects: Sequence[Effect]) -> None:
    if not effects:
        return
    table = _table(f"what {what} is worth", ("method", "n", "with", "w/o", "ratio", "95 %", "p"))
    for e in effects:
        table.add_row(
            e.method,
            str(e.difference.pairs),
            f"{e.spl_with:.3f}",
            f"{e.spl_without:.3f}",
            _ratio(e.ratio),
            _interval(e.difference),
            f"{e.difference.p:.3f}",
        )
    screen.print(table)


def _interval(difference: PairedDifference) -> str:
    return "-" if difference.ci95 is None else "{:+.2f}..{:+.2f}".format(*difference.ci95)


def _ratio(ratio: Ratio | None) -> str:
    return "-" if ratio is None else f"{ratio.value:.2f}"


def _ratio_interval(ratio: Ratio | None) -> str:
    return "-" if ratio is None or ratio.ci95 is None else "{:.2f}-{:.2f}".format(*ratio.ci95)


def _table(title: str, heads: Sequence[str]) -> Table:
    table = Table(title=title, box=SIMPLE_HEAD, pad_edge=False)
    for head in heads:
        # A long name is broken over lines, so that no figure is cut.
        name = head == "method"
        table.add_column(
            head, justify="left" if name else "right", no_wrap=not name, overflow="fold"
        )
    return table
