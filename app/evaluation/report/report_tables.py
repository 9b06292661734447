"""The tables of an evaluation's page."""

from collections.abc import Iterable, Sequence
from html import escape

from app.evaluation.report.report_data import ReportData
from ippon.evaluation.methods.method_table import method_named
from ippon.evaluation.statistics import PairedDifference, Ratio
from ippon.evaluation.summary import Effect, Losses, MethodSummary, Part


def methods_table(summaries: Sequence[MethodSummary]) -> str:
    """Return the means of each method."""
    head = (
        "method", "episodes", "success", "SPL", "SoftSPL", "find, s", "contacts", "time, s",
        "path, m",
        "planner p95, ms", "× real time",
    )  # fmt: skip
    body = [
        (
            s.method,
            str(s.episodes),
            _with_interval(s.success, s.success_ci95),
            _with_interval(s.spl, s.spl_ci95),
            _with_interval(s.soft_spl, s.soft_spl_ci95),
            "–" if s.find_s is None else f"{s.find_s:.0f}",
            f"{s.hits:.2f}",
            f"{s.time_s:.0f}",
            f"{s.path_length_m:.1f}",
            f"{s.planner_ms_p95:.0f}",
            f"{s.realtime_factor:.1f}",
        )
        for s in summaries
    ]
    names = "; ".join(f"{s.method}: {_summary_of(s.method)}" for s in summaries)
    return _table(head, body) + (
        '<p class="dim">Brackets: 95 % intervals, of success by Wilson\'s formula, else by a '
        'bootstrap over homes. "Find" is the median time '
        "to the find, a search without success counting as endless; it and the mean time are "
        f"simulated. The planner's is processor time of one core. {escape(names)}.</p>"
    )


def _summary_of(method: str) -> str:
    """Return the description of a method; rows may come from a version with other methods."""
    try:
        return method_named(method.partition(" (")[0]).summary
    except ValueError:
        return "unknown to this version"


def pairs_table(data: ReportData) -> str:
    """Return the reference against each other method."""
    head = (
        "less", "pairs", "SPL difference", "s.e.", "p", "SPL ratio", "success difference", "p",
        "time to the find, ratio",
    )  # fmt: skip
    body = [
        (
            c.method,
            str(c.spl.pairs),
            _difference(c.spl),
            _error(c.spl),
            f"{c.spl.p:.3f}",
            _ratio(c.spl_ratio),
            _difference(c.success),
            f"{c.success_p:.3f}",
            _ratio(c.find_s_ratio),
        )
        for c in data.comparisons
    ]
    return _table(head, body) + (
        '<p class="dim">Brackets: 95 % intervals, s.e.: standard error, both by a bootstrap over '
        "homes. p: probability of a difference as large if the two methods were equal; of SPL by a "
        "sign-flip test over homes, of success by the exact McNemar test. Ratio of SPL: of the "
        "reference over the method's; of times: the method's finds over those of the reference, "
        "where both succeed.</p>"
    )


def effects_table(effects: Sequence[Effect]) -> str:
    """Return the searches of each method with and without something."""
    head = ("method", "pairs", "SPL with", "SPL without", "ratio", "difference", "s.e.", "p")
    body = [
        (
            e.method,
            str(e.difference.pairs),
            f"{e.spl_with:.3f}",
            f"{e.spl_without:.3f}",
            _ratio(e.ratio),
            _difference(e.difference),
            _error(e.difference),
            f"{e.difference.p:.3f}",
        )
        for e in effects
    ]
    return _table(head, body)


def parts_table(parts: Sequence[Part]) -> str:
    """Return the figures of each method by path and by object."""
    body = [(p.name, p.method, str(p.episodes), f"{p.success:.2f}", f"{p.spl:.3f}") for p in parts]
    return _table(("episodes with", "method", "number", "success", "SPL"), body)


def losses_table(losses: Sequence[Losses]) -> Iterable[str]:
    """Yield where each method lost its SPL; nothing for rows that do not say it."""
    if not losses:
        return
    head = (
        "method", "episodes", "before the first view", "until it is in the map",
        "until a stop would count", "until the stop", "false stops", "other failures",
    )  # fmt: skip
    body = [
        (one.method, str(one.episodes), *(f"{x:.3f}" for x in losses_in_order(one)))
        for one in losses
    ]
    yield "<h2>Where SPL is lost</h2>"
    yield _table(head, body)
    yield (
        '<p class="dim">Shares of an SPL of 1. A straight way to the object from the end of each '
        "stage would have had an SPL of 1 less all losses so far; what a failure could still have "
        "had counts as lost by it.</p>"
    )


def losses_in_order(one: Losses) -> tuple[float, ...]:
    """Return the losses in the order in which a search passes them."""
    return (
        one.before_view, one.to_map, one.to_reach, one.to_stop, one.false_stops, one.other_failures,
    )  # fmt: skip


def _table(head: Sequence[str], body: Iterable[Sequence[str]]) -> str:
    top = "".join(f"<th>{escape(h)}</th>" for h in head)
    lines = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in line) + "</tr>" for line in body
    )
    return f"<table><tr>{top}</tr>{lines}</table>"


def _with_interval(value: float, interval: tuple[float, float] | None) -> str:
    return f"{value:.3f}" + ("" if interval is None else " [{:.2f}, {:.2f}]".format(*interval))


def _ratio(ratio: Ratio | None) -> str:
    if ratio is None:
        return "–"
    return f"{ratio.value:.2f}" + (
        "" if ratio.ci95 is None else " [{:.2f}, {:.2f}]".format(*ratio.ci95)
    )


def _difference(d: PairedDifference) -> str:
    return f"{d.mean:+.3f}" + ("" if d.ci95 is None else " [{:+.3f}, {:+.3f}]".format(*d.ci95))


def _error(d: PairedDifference) -> str:
    return "–" if d.standard_error is None else f"{d.standard_error:.3f}"
