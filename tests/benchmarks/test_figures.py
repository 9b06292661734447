"""`scripts/benchmark all`: figures over several runs, kept, shown, and compared."""

import pytest

from tests.benchmarks import figures


@pytest.fixture
def kept(tmp_path, monkeypatch):
    monkeypatch.setattr(figures, "KEPT", tmp_path / "figures.json")
    monkeypatch.setattr(figures, "PAGE", tmp_path / "figures.md")
    return tmp_path


def _measured(*milliseconds):
    """Return what runs the map's benchmark with these times, one after the other."""
    times = iter(milliseconds)

    def run(part):
        ms = next(times)
        row = {"name": "update", "data": "home", "voxel_size_m": 0.1, "median_ms": ms}
        peer = {"peer": "Open3D", "peer_median_ms": 8.0, "ratio": 8.0 / ms}
        memory = {"name": "memory", "data": "home", "median_ms": None, "value": 11.0, "unit": "MB"}
        return [{**row, **peer}, memory]

    return run


def _regenerate(run, runs=3):
    return figures.regenerate(["map"], runs, lambda _: None, run)


def test_a_figure_is_the_median_with_its_range_and_its_peer(kept):
    assert _regenerate(_measured(4.0, 2.0, 5.0)) == []
    page = (kept / "figures.md").read_text()
    assert "## `scripts/benchmark map`" in page
    assert "| update | home, 10 cm | 4 (2 to 5) ms | 3 |" in page
    assert "| update, Open3D relative to it | home, 10 cm | 2 (1.6 to 4) times | 3 |" in page
    assert "| memory | home | 11 MB | 3 |" in page


def test_what_lies_within_the_noise_has_not_moved_and_the_rest_is_named(kept):
    _regenerate(_measured(4.0, 2.0, 5.0))
    assert _regenerate(_measured(4.9, 6.0, 7.0)) == []
    moved = _regenerate(_measured(2.0, 2.5, 3.0))
    assert moved == [
        "map: update (home, 10 cm): 6 (4.9 to 7) before, 2.5 (2 to 3) now, ms",
        (
            "map: update, Open3D relative to it (home, 10 cm): "
            "1.333 (1.143 to 1.633) before, 3.2 (2.667 to 4) now, times"
        ),
    ]


def test_a_time_is_compared_with_a_time(kept):
    def run(part):
        time = {"name": "change", "data": "home", "median_ms": 3.0}
        return [time, {"name": "change", "data": "home", "value": 12.0, "unit": "kB"}]

    _regenerate(run)
    assert _regenerate(run) == []


def test_what_else_was_measured_is_shown_and_does_not_tell_figures_apart(kept):
    def run(value, spread):
        row = {"name": "gain", "data": "40 searches", "value": value, "unit": "nat"}
        return lambda _: [{**row, "note": f"standard error {spread}"}]

    _regenerate(run(1.0, 0.1))
    moved = _regenerate(run(2.0, 0.2))
    assert moved == ["map: gain (40 searches): 1 before, 2 now, nat"]
    page = (kept / "figures.md").read_text()
    assert "| gain | 40 searches | 2 nat; standard error 0.2 | 3 |" in page


def test_a_part_that_is_measured_by_name_only_is_kept_after_the_others(kept):
    rows = [{"name": "san", "data": "640x640", "median_ms": 10.0}]
    figures.regenerate(["segmentation"], 1, lambda _: None, lambda _: rows)
    _regenerate(_measured(4.0), runs=1)
    parts = [figure.part for figure in figures.read_kept()]
    assert parts == ["map", "map", "map", "segmentation"]


def test_other_parts_keep_their_figures(kept):
    _regenerate(_measured(4.0), runs=1)
    guidance = [{"name": "levels", "data": "40 labels", "median_ms": 0.25}]
    figures.regenerate(["guidance"], 1, lambda _: None, lambda _: guidance)
    assert [figure.part for figure in figures.read_kept()] == ["guidance", "map", "map", "map"]


def test_a_part_that_fails_leaves_what_was_kept(kept):
    _regenerate(_measured(4.0), runs=1)
    before = (kept / "figures.json").read_text()

    def fails(part):
        raise RuntimeError(part)

    with pytest.raises(RuntimeError):
        _regenerate(fails)
    assert (kept / "figures.json").read_text() == before


def test_the_page_of_the_documents_shows_what_is_kept(tmp_path, monkeypatch):
    shown = figures.PAGE.read_text().splitlines()
    monkeypatch.setattr(figures, "KEPT", tmp_path / "figures.json")
    monkeypatch.setattr(figures, "PAGE", tmp_path / "figures.md")
    kept = figures.ROOT / "docs/figures.json"
    figures.KEPT.write_text(kept.read_text())
    figures.write_kept(figures.read_kept())
    again = figures.PAGE.read_text().splitlines()
    assert [line for line in again if line.startswith("|")] == [
        line for line in shown if line.startswith("|")
    ]
