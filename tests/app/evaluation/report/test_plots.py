from app.evaluation.report.plots import (
    _COLOURS,
    _DASHES,
    _MARKS,
    _label,
    goal_plot,
    legend,
    style_of,
    success_curves,
)
from ippon.evaluation.methods.method_table import METHODS


def test_no_method_looks_like_another():
    most = len(_COLOURS) * len(_DASHES)
    styles = style_of([*METHODS, *(f"new {k}" for k in range(most - len(METHODS)))])
    assert len(set(styles.values())) == most
    # In black and white, or where two colours look alike, lines and marks still differ.
    assert set(_DASHES) == set(_MARKS) == {style.line for style in styles.values()}


def test_a_long_name_keeps_both_ends_beside_a_plot():
    assert _label("semantic_frontier") == "semantic_frontier"
    label = _label("gain_squared (results-fusion)")
    assert (len(label), label[:9], label[-9:]) == (20, "gain_squa", "s-fusion)")


def test_every_style_reaches_curves_points_and_legend(make_row):
    groups = {name: [make_row(method=name)] for name in METHODS}
    curves = success_curves(groups)
    drawn = {(s.colour, _DASHES[s.line]) for s in style_of(list(METHODS)).values()}
    for colour, dash in drawn:
        assert f'stroke="{colour}" stroke-width="2" stroke-dasharray="{dash}"' in curves
    points = goal_plot({"bed": dict.fromkeys(METHODS, (0.5, 1))}, list(METHODS))
    assert points.count("<title>") == len(METHODS)
    assert points.count("<circle") == 8
    assert all(name.replace("_", " ") in legend(style_of(list(METHODS))) for name in METHODS)
