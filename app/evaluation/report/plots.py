"""Plots of an evaluation as SVG text."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Final

import numpy as np

from ippon.evaluation.outcome import FAILURES
from ippon.evaluation.row import EpisodeRow
from ippon.evaluation.summary import MethodSummary
from ippon.vocabulary import in_words

_COLOURS: Final = (
    "#D55E00", "#56B4E9", "#009E73", "#E69F00", "#CC79A7", "#0072B2", "#F0E442", "#9AA0A6",
)  # fmt: skip
"""Okabe-Ito palette, distinguishable for colour-blind readers, with grey instead of black."""
_DASHES: Final = {"solid": "none", "dashed": "9 5", "dotted": "2 4"}
"""CSS line styles with their SVG dashes; each is used with every colour before the next."""
_MARKS: Final = {"solid": "●", "dashed": "■", "dotted": "▲"}
_FAILURE_COLOURS: Final = {
    "never_seen": "#0072B2",
    "seen_and_missed": "#56B4E9",
    "false_stop": "#D55E00",
    "wrong_instance": "#9AA0A6",
    "out_of_reach": "#009E73",
    "collision": "#F0E442",
    "stuck": "#CC79A7",
    "time": "#E69F00",
}
_WIDTH: Final = 760
_LEFT: Final = 150
_RIGHT: Final = 24
_ROW: Final = 24
_LABEL: Final = 20
"""Most characters of a name beside a plot."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Style:
    """Colour and line style of a method, unique among the methods."""

    colour: str
    line: str
    """Line style, which also selects the mark of the points."""


@dataclass(slots=True)
class _Svg:
    """Collects the parts of one drawing."""

    height: float
    title: str
    parts: list[str] = field(default_factory=list[str])

    def line(self, x0: float, y0: float, x1: float, y1: float, style: str) -> None:
        self.parts.append(
            f'<line x1="{x0:.1f}" y1="{y0:.1f}" x2="{x1:.1f}" y2="{y1:.1f}" {style}/>'
        )

    def text(self, x: float, y: float, text: str, anchor: str = "start") -> None:
        self.parts.append(
            f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(text)}</text>'
        )

    def mark(self, x: float, y: float, style: Style, tip: str) -> None:
        points = {
            "solid": f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5"',
            "dashed": f'<path d="M{x - 4.5:.1f} {y - 4.5:.1f}h9v9h-9z"',
            "dotted": f'<path d="M{x - 5.5:.1f} {y + 4.5:.1f}h11l-5.5-10z"',
        }
        tag = "circle" if style.line == "solid" else "path"
        self.parts.append(
            f'{points[style.line]} fill="{style.colour}"><title>{escape(tip)}</title></{tag}>'
        )

    def bar(self, x: float, y: float, width: float, colour: str, tip: str) -> None:
        self.parts.append(
            f'<rect x="{x:.1f}" y="{y:.1f}" width="{max(width, 0.0):.1f}" height="16" '
            f'fill="{colour}"><title>{escape(tip)}</title></rect>'
        )

    def finish(self) -> str:
        body = "".join(self.parts)
        return (
            f'<svg viewBox="0 0 {_WIDTH} {self.height:.0f}" role="img" font-size="13" '
            f'fill="currentColor" aria-label="{escape(self.title)}">{body}</svg>'
        )


def _label(name: str) -> str:
    """Return a name that fits beside a plot: its ends, where methods of several folders differ."""
    return name if len(name) <= _LABEL else f"{name[:9]}…{name[9 - _LABEL + 1 :]}"


def style_of(methods: Sequence[str]) -> dict[str, Style]:
    """Return the style of each method; the first ones have solid lines."""
    lines = tuple(_DASHES)
    return {
        name: Style(colour=_COLOURS[k % len(_COLOURS)], line=lines[k // len(_COLOURS) % len(lines)])
        for k, name in enumerate(methods)
    }


def interval_plot(summaries: Sequence[MethodSummary]) -> str:
    """Draw each method's SPL with its 95 % interval."""
    svg = _Svg(height=_ROW * len(summaries) + 48, title="SPL with 95 % intervals")
    intervals = [s.spl_ci95 or (s.spl, s.spl) for s in summaries]
    top = max(0.05, *(high for _, high in intervals))
    limit = min(1.0, np.ceil(top * 10.0) / 10.0)
    _axis(svg, limit, _ROW * len(summaries) + 6, "SPL")
    styles = style_of([s.method for s in summaries])
    for k, s in enumerate(summaries):
        y = _ROW * (k + 0.5) + 2
        low, high = (_x(v, limit) for v in intervals[k])
        svg.text(_LEFT - 8, y + 4, _label(s.method), "end")
        svg.line(low, y, high, y, f'stroke="{styles[s.method].colour}" stroke-width="3"')
        tip = f"{s.method}: {s.spl:.3f}"
        if s.spl_ci95 is not None:
            tip += " [{:.3f}, {:.3f}]".format(*s.spl_ci95)
        svg.mark(_x(s.spl, limit), y, styles[s.method], tip)
    return svg.finish()


def success_curves(groups: Mapping[str, Sequence[EpisodeRow]]) -> str:
    """Draw the share of episodes that succeeded within a path length."""
    height, bottom = 300.0, 256.0
    svg = _Svg(height=height, title="success against path length")
    lengths = [r.path_length_m for rows in groups.values() for r in rows if r.success]
    limit = max(1.0, float(np.ceil(max(lengths, default=1.0) / 5.0) * 5.0))
    _axis(svg, limit, bottom, "path length, m")
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        y = bottom - share * (bottom - 10.0)
        svg.line(_LEFT, y, _WIDTH - _RIGHT, y, 'stroke="currentColor" stroke-opacity="0.15"')
        svg.text(_LEFT - 8, y + 4, f"{share:.0%}", "end")
    styles = style_of(list(groups))
    for name, rows in groups.items():
        solved = sorted(r.path_length_m for r in rows if r.success)
        points = [(_x(0.0, limit), bottom)]
        for k, length in enumerate(solved):
            x = _x(length, limit)
            points += [(x, points[-1][1]), (x, bottom - (k + 1) / len(rows) * (bottom - 10.0))]
        points.append((_x(limit, limit), points[-1][1]))
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        svg.parts.append(
            f'<polyline points="{path}" fill="none" stroke="{styles[name].colour}" '
            f'stroke-width="2" stroke-dasharray="{_DASHES[styles[name].line]}">'
            f"<title>{escape(name)}</title></polyline>"
        )
    return svg.finish() + legend(styles)


def goal_plot(table: Mapping[str, Mapping[str, tuple[float, int]]], methods: Sequence[str]) -> str:
    """Draw each method's mean SPL for each goal."""
    svg = _Svg(height=_ROW * len(table) + 48, title="SPL by goal")
    _axis(svg, 1.0, _ROW * len(table) + 6, "SPL")
    styles = style_of(methods)
    for k, (goal, of) in enumerate(table.items()):
        y = _ROW * (k + 0.5) + 2
        count = max(n for _, n in of.values())
        svg.text(_LEFT - 8, y + 4, f"{in_words(goal)} ({count})", "end")
        svg.line(_LEFT, y, _WIDTH - _RIGHT, y, 'stroke="currentColor" stroke-opacity="0.15"')
        for name, (spl, n) in of.items():
            # Equal values are drawn side by side.
            aside = 6.0 * (list(styles).index(name) / max(1, len(styles) - 1) - 0.5)
            tip = f"{goal}, {name}: {spl:.3f}, {n} episodes"
            svg.mark(_x(spl, 1.0), y + aside, styles[name], tip)
    return svg.finish() + legend(styles)


def failure_plot(summaries: Sequence[MethodSummary]) -> str:
    """Draw the share of episodes that failed, by cause."""
    svg = _Svg(height=_ROW * len(summaries) + 48, title="failure causes")
    shares = [sum(s.failures.values()) / s.episodes for s in summaries]
    limit = max(0.1, float(np.ceil(max(shares) * 10.0) / 10.0))
    _axis(svg, limit, _ROW * len(summaries) + 6, "share of episodes")
    for k, s in enumerate(summaries):
        x, y = float(_LEFT), _ROW * k + 6.0
        svg.text(_LEFT - 8, y + 12, _label(s.method), "end")
        for cause in FAILURES:
            count = s.failures.get(cause, 0)
            width = _x(count / s.episodes, limit) - _LEFT
            if count:
                svg.bar(x, y, width, _FAILURE_COLOURS[cause], f"{s.method}, {cause}: {count}")
            x += width
    items = (
        f'<span><i style="background:{colour}"></i>{escape(cause.replace("_", " "))}</span>'
        for cause, colour in _FAILURE_COLOURS.items()
    )
    return svg.finish() + f'<p class="legend">{"".join(items)}</p>'


def legend(styles: Mapping[str, Style]) -> str:
    """Return a legend with the name, line and mark of each method."""
    items = (
        f'<span><b style="border-top:3px {style.line} {style.colour}"></b>'
        f'<b style="color:{style.colour}">{_MARKS[style.line]}</b>'
        f"{escape(name.replace('_', ' '))}</span>"
        for name, style in styles.items()
    )
    return f'<p class="legend">{"".join(items)}</p>'


def _x(value: float, limit: float) -> float:
    return _LEFT + value / limit * (_WIDTH - _LEFT - _RIGHT)


def _axis(svg: _Svg, limit: float, y: float, label: str) -> None:
    svg.line(_LEFT, y, _WIDTH - _RIGHT, y, 'stroke="currentColor"')
    for k in range(6):
        value = limit * k / 5.0
        x = _x(value, limit)
        svg.line(x, y, x, y + 4, 'stroke="currentColor"')
        text = f"{value:.0f}" if limit > 5.0 else f"{value:.2f}"
        svg.text(x, y + 17, text, "middle")
    svg.text(0.5 * (_LEFT + _WIDTH - _RIGHT), y + 36, label, "middle")
