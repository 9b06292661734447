import csv
import dataclasses
import json
import math
import re
from pathlib import Path

import pytest

from app.cli.evaluation.report import run_eval_report
from app.cli.options.evaluation import EvalReport
from app.errors import UsageError
from app.evaluation.errors import EvaluationError
from app.evaluation.report.report_page import replay_command
from app.evaluation.results_folder import SESSIONS, EvaluationFolder
from ippon.evaluation.outcome import FAILURES

_SETTINGS = {
    "fixed": {"seed": 4, "robot": "zed", "image_width": 320, "voxel_size_m": 0.1},
    "command": {"starts": "2"},
}


@pytest.fixture
def results(tmp_path, make_row):
    """Two methods, two homes, two episodes each."""
    folder = EvaluationFolder(tmp_path / "out")
    folder.open_for(_SETTINGS)
    for method, figures in {"ippon": (0.6, 0.4), "oracle": (1.0, 0.0)}.items():
        for home, spl in zip("12", figures, strict=True):
            found = spl > 0.0
            folder.write(
                make_row(
                    episode_id=f"{home}.bed.0.untold", home=home, method=method, spl=spl,
                    soft_spl=spl / 2, success=found, hits=int(home), cpu_s=6.0, time_s=60.0,
                    failure="none" if found else "stuck", ending="found" if found else "time",
                )
            )  # fmt: skip
    return folder


def test_the_json_table_by_hand(results, capsys):
    assert run_eval_report(EvalReport(folder=results.path, json=True)) == 0
    ippon, oracle = json.loads(capsys.readouterr().out)
    assert ippon == {
        "method": "ippon",
        "episodes": 2,
        "success": 1.0,
        "spl": 0.5,
        "soft_spl": 0.25,
        "spl_ci95": [0.4, 0.6],
        "find_s": 60.0,
        "hits": 1.5,
        "planner_ms_p95": 20.0,
        "realtime_factor": 10.0,
    }
    assert (oracle["success"], oracle["spl_ci95"]) == (0.5, [0.0, 1.0])


def test_failures_before_their_time_are_told_from_lack_of_time(results, make_row, capsys):
    ends = {"4.bed.0.untold": ("exhausted", 87.0), "5.bed.0.untold": ("time", 500.0)}
    for name, (ending, time_s) in ends.items():
        row = make_row(success=False, failure="never_seen", ending=ending, time_s=time_s)
        results.write(
            dataclasses.replace(row, episode_id=name, home=name[0], distance_to_goal_m=3.0)
        )
    run_eval_report(EvalReport(folder=results.path, detail=True))
    out = capsys.readouterr().out
    assert re.search(r"ippon\s+never seen\s+2\s+1\s", out)
    assert re.search(r"oracle\s+stuck\s+1\s+0\s", out)
    page = (results.path / "report.html").read_text()
    assert "nothing left to look at: ippon 1 of 2, oracle 0 of 1." in page
    assert "3.0 m away, nothing left to look at after 87 s" in page
    assert "3.0 m away, ended after 500 s" in page


def test_a_single_search_has_a_dash_for_an_interval(tmp_path, make_row, capsys):
    folder = EvaluationFolder(tmp_path / "one")
    folder.open_for(_SETTINGS)
    for method, spl in (("ippon", 0.5), ("oracle", 0.9)):
        folder.write(make_row(method=method, spl=spl, soft_spl=spl))
    run_eval_report(EvalReport(folder=folder.path))
    out, err = capsys.readouterr()
    assert re.search(r"ippon\s+1\s+\S+\s+0\.500\s+-\s", out)
    assert re.search(r"oracle\s+1\s+-0\.400\s+-\s", out)
    said = "intervals over fewer than 10 homes are too narrow; a method has 1"
    assert f"ippon: {said}\n" in err
    page = (folder.path / "report.html").read_text()
    assert "<td>0.500</td>" in page
    assert said in page
    run_eval_report(EvalReport(folder=folder.path, json=True))
    assert json.loads(capsys.readouterr().out)[0]["spl_ci95"] is None


def test_a_rule_that_gave_no_targets_is_said(results, make_row, capsys):
    for home in "12":
        name = f"{home}.bed.0.untold"
        for method, left in (("nearest_frontier", 10), ("mine", 90)):
            row = make_row(method=method, home=home, rule_steps=100, unruled_steps=left)
            results.write(dataclasses.replace(row, episode_id=name))
    run_eval_report(EvalReport(folder=results.path))
    out, err = (" ".join(text.split()) for text in capsys.readouterr())
    assert "nearest_frontier: in 10 % of the steps" in out
    assert "mine: in 90 %" not in out
    assert "ippon: mine: in 90 % of the steps" in err
    assert "its figures are mostly those of that planner" in err
    page = (results.path / "report.html").read_text()
    assert '<p class="warn">mine: in 90 %' in page
    assert '<p class="dim">nearest_frontier: in 10 %' in page
    assert "oracle: in" not in page


def test_every_search_is_a_line_of_the_csv(results, make_row):
    results.write(make_row(episode_id="3.bed.0.untold", home="3", shortest_path_m=math.inf))
    run_eval_report(EvalReport(folder=results.path))
    with (results.path / "episodes.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 5
    assert {row["method"] for row in rows} == {"ippon", "oracle"}
    assert {row["shortest_path_m"] for row in rows if row["home"] == "3"} == {""}
    assert "path_x_m" not in rows[0]


def test_methods_of_ones_own_are_no_other_version_of_the_program(results, make_row):
    rows = results.rows()
    results.write(make_row(episode_id="3.bed.0.untold", version=f"{rows[0].version}, my code 12ab"))
    run_eval_report(EvalReport(folder=results.path))
    assert "different versions" not in (results.path / "report.html").read_text()
    results.write(make_row(episode_id="3.bed.0.untold", version="ippon 0.0.1"))
    run_eval_report(EvalReport(folder=results.path))
    assert "different versions" in (results.path / "report.html").read_text()


@pytest.mark.parametrize("as_json", [False, True])
def test_the_terminal_says_what_the_page_warns_of(results, make_row, capsys, as_json):
    results.write(make_row(episode_id="3.bed.0.untold", home="3", version="ippon 0.0.1"))
    run_eval_report(EvalReport(folder=results.path, json=as_json))
    told = capsys.readouterr().err.splitlines()
    page = (results.path / "report.html").read_text()
    warned = re.findall(r'<p class="warn">(.*?)\.</p>', page)
    assert told == [f"ippon: {text}" for text in warned]
    assert [re.match(r"\w+ \w+ ?\w*", text)[0] for text in warned] == [
        "small sample",
        "intervals over fewer",
        "methods ran different",
        "rows were made",
    ]


def test_the_table_fits_a_narrow_terminal(results, make_row, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    results.write(make_row(method="semantic_frontier", hits=10, planner_ms_p95=1234.0))
    run_eval_report(EvalReport(folder=results.path))
    out = capsys.readouterr().out
    assert "…" not in out
    assert "0.40-0.60" in out
    assert "means over episodes" in out
    # The pairs differ by -0.4 and +0.4.
    assert re.search(r"oracle\s+2\s+\+0\.000\s+-0\.40\.\.\+0\.40\s+1\.000", out)
    assert max(len(line) for line in out.splitlines() if "report.html" not in line) <= 80


def test_a_long_name_of_a_folder_costs_no_figure(results, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    other = EvaluationFolder(tmp_path / "before-the-change-of-the-planner-of-yesterday")
    other.open_for(_SETTINGS)
    for row in results.rows():
        other.write(row)
    run_eval_report(EvalReport(folder=results.path, against=(other.path,), detail=True))
    out = capsys.readouterr().out
    assert "…" not in out
    assert out.count("0.40-0.60") == 2
    # A standard error, and ratios with their intervals.
    assert "ippon against each: standard error and ratios" in out
    assert re.search(r"\+0\.000\s+0\.000\s+1\.00\s+1\.00-1\.00\s+1\.00\s+1\.00-1\.00", out)
    assert max(len(line) for line in out.splitlines() if "report.html" not in line) <= 80


@pytest.mark.parametrize("as_json", [False, True])
def test_figures_of_a_folder_that_cannot_be_written_are_shown(results, capsys, as_json):
    (results.path / "report.html").mkdir()
    with pytest.raises(UsageError, match="cannot write to"):
        run_eval_report(EvalReport(folder=results.path, json=as_json))
    assert "oracle" in capsys.readouterr().out


def test_the_page_is_whole_and_needs_nothing_from_elsewhere(results, capsys):
    run_eval_report(EvalReport(folder=results.path))
    page = (results.path / "report.html").read_text()
    assert page.count("<svg") == page.count("</svg>") == 4
    assert not re.search(r'(src|href)="', page)
    assert "small sample" in page
    assert "0.500 [0.40, 0.60]" in page
    assert "s.e." in page
    assert "oracle, stuck: 1" in page
    assert f"ippon eval replay {results.path} 2.bed.0.untold --method oracle" in page
    everything = json.loads((results.path / "report.json").read_text())
    (compared,) = everything["comparisons"]
    assert compared["spl"]["mean"] == 0.0
    assert 0.0 < compared["spl"]["standard_error"] < 0.4
    assert compared["spl_ratio"]["value"] == 1.0
    assert everything["settings"]["fixed"]["seed"] == 4


def test_episodes_that_crashed_are_shown(results, capsys):
    results.write_error("3.bed.0.untold.ippon", "Traceback")
    run_eval_report(EvalReport(folder=results.path))
    assert "3.bed.0.untold.ippon ended with an error" in capsys.readouterr().err
    assert "1 episodes failed with an error" in (results.path / "report.html").read_text()


def test_names_from_a_home_cannot_break_the_page(results, make_row, capsys):
    results.write(
        make_row(home="<script>x</script>", episode_id="evil.bed.0.untold", success=False,
                 failure="time", ending="time")
    )  # fmt: skip
    run_eval_report(EvalReport(folder=results.path))
    assert "<script>" not in (results.path / "report.html").read_text()


def test_an_episode_can_be_watched(results, make_row, capsys):
    row = make_row(episode_id="studio.hat.0.told", method="no_bayes")
    command = "ippon eval replay 'a b' studio.hat.0.told --method no_bayes"
    assert replay_command(Path("a b"), row) == command
    results.write(row)
    session = results.path / SESSIONS / "studio.hat.0.told.no_bayes" / "2026 #1"
    session.mkdir(parents=True)
    (session / "metadata.yaml").touch()
    run_eval_report(EvalReport(folder=results.path))
    page = (results.path / "report.html").read_text()
    assert f'href="{SESSIONS}/studio.hat.0.told.no_bayes/2026%20%231/"' in page
    assert "ippon review" in page


def test_nothing_to_report_is_a_clear_error(tmp_path):
    with pytest.raises(UsageError, match="holds no results"):
        run_eval_report(EvalReport(folder=tmp_path))


def test_a_method_of_another_version_stands_last(results, make_row, capsys):
    results.write(make_row(method="tomorrow's", hits=3))
    assert run_eval_report(EvalReport(folder=results.path, json=True)) == 0
    methods = [line["method"] for line in json.loads(capsys.readouterr().out)]
    assert methods == ["ippon", "oracle", "tomorrow's"]
    assert run_eval_report(EvalReport(folder=results.path)) == 0
    page = (results.path / "report.html").read_text()
    assert "tomorrow&#x27;s: unknown to this version" in page


def test_every_cause_of_a_failure_is_explained(results, capsys):
    run_eval_report(EvalReport(folder=results.path))
    page = (results.path / "report.html").read_text()
    for cause in FAILURES:
        assert f"{cause.replace('_', ' ')}: " in page
        assert f"{cause.replace('_', ' ')}</span>" in page


def test_every_episode_says_how_to_watch_it(results, make_row, capsys):
    start = "1.hat.0.untold.bed"
    results.write(make_row(episode_id=f"{start}.second", kind="second", after="hat"))
    results.write(make_row(episode_id=f"{start}.fresh", kind="fresh", after="hat"))
    session = results.path / SESSIONS / "1.bed.0.untold.oracle" / "2026"
    session.mkdir(parents=True)
    (session / "metadata.yaml").touch()
    run_eval_report(EvalReport(folder=results.path))
    page = (results.path / "report.html").read_text()
    for row in results.rows():
        assert (replay_command(results.path, row) in page) is (row.kind != "second")
    (line,) = [ln for ln in page.split("<tr>") if "1.bed.0.untold --method oracle" in ln]
    assert f'<a href="{SESSIONS}/1.bed.0.untold.oracle/2026/">recording</a>' in line
    assert page.count(">recording</a>") == 1
    assert "3 episodes that found the object" in page
    assert "starts with the map of the search before it" in page


def test_methods_are_compared_with_the_reference_that_is_named(results, capsys):
    run_eval_report(EvalReport(folder=results.path, reference="oracle"))
    assert "oracle less each, on the same episodes" in capsys.readouterr().out
    assert "oracle against each" in (results.path / "report.html").read_text()
    with pytest.raises(UsageError, match="has no rows of greedy_nbv; there are ippon, oracle"):
        run_eval_report(EvalReport(folder=results.path, reference="greedy_nbv"))


def test_a_run_before_a_change_is_compared_episode_by_episode(results, make_row, tmp_path, capsys):
    before = EvaluationFolder(tmp_path / "before")
    before.open_for({**_SETTINGS, "fixed": {**_SETTINGS["fixed"], "voxel_size_m": 0.05}})
    for home, spl in zip("12", (0.5, 0.2), strict=True):
        before.write(make_row(episode_id=f"{home}.bed.0.untold", home=home, spl=spl))
    command = EvalReport(folder=results.path, against=(before.path,), json=True)
    assert run_eval_report(command) == 0
    captured = capsys.readouterr()
    spl = {line["method"]: line["spl"] for line in json.loads(captured.out)}
    assert spl == {"ippon": 0.5, "oracle": 0.5, "ippon (before)": 0.35}
    assert "voxel_size_m is 0.1, in before 0.05" in captured.err
    everything = json.loads((results.path / "report.json").read_text())
    pairs = {c["method"]: c["spl"] for c in everything["comparisons"]}
    assert pairs["ippon (before)"]["mean"] == pytest.approx(0.15)
    page = (results.path / "report.html").read_text()
    assert "ippon (before)" in page
    # Episodes are recorded again from the folder that holds them.
    assert page.count("ippon eval replay") == 4


def test_folders_of_one_name_cannot_be_told_apart(results, tmp_path):
    other = tmp_path / "elsewhere" / results.path.name
    with pytest.raises(EvaluationError, match="two folders are called out"):
        run_eval_report(EvalReport(folder=results.path, against=(other,)))


def test_runs_are_pooled_as_if_they_were_in_one_folder(results, make_row, tmp_path, capsys):
    more = EvaluationFolder(tmp_path / "more")
    more.open_for({**_SETTINGS, "fixed": {**_SETTINGS["fixed"], "seed": 5}})
    more.write(make_row(episode_id="3.bed.0.untold", home="3", spl=0.8))
    more.write_error("4.bed.0.untold.ippon", "Traceback")
    session = more.path / SESSIONS / "3.bed.0.untold.ippon" / "2026"
    session.mkdir(parents=True)
    (session / "metadata.yaml").touch()
    run_eval_report(EvalReport(folder=results.path, pool=(more.path,), json=True))
    captured = capsys.readouterr()
    ippon = json.loads(captured.out)[0]
    assert (ippon["episodes"], ippon["spl"]) == (3, 0.6)
    assert "seed is 4, in more 5" in captured.err
    assert "4.bed.0.untold.ippon ended with an error" in captured.err
    page = (results.path / "report.html").read_text()
    assert f"ippon eval replay {more.path} 3.bed.0.untold" in page
    assert f'href="../more/{SESSIONS}/3.bed.0.untold.ippon/2026/"' in page
    more.write(make_row(episode_id="1.bed.0.untold"))
    with pytest.raises(EvaluationError, match=r"both hold 1\.bed\.0\.untold by ippon"):
        run_eval_report(EvalReport(folder=results.path, pool=(more.path,)))


def test_the_detail_says_where_spl_is_lost(results, make_row, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    detail = EvalReport(folder=results.path, detail=True)
    run_eval_report(detail)
    out = capsys.readouterr().out
    assert "rows of an earlier version do not say where SPL was lost" in out
    assert re.search(r"oracle\s+path 4 to 8 m\s+2\s+0\.50\s+0\.500", out)
    assert re.search(r"oracle\s+stuck\s+1", out)
    assert "Where SPL is lost" not in (results.path / "report.html").read_text()
    kept = {"seen_spl": 0.9, "mapped_spl": 0.8, "reached_spl": 0.7}
    for row in results.rows():
        results.write(dataclasses.replace(row, **kept))
    run_eval_report(detail)
    out = capsys.readouterr().out
    assert re.search(r"ippon\s+2\s+0\.100\s+0\.100\s+0\.100\s+0\.200\s+0\.000\s+0\.000", out)
    assert max(len(line) for line in out.splitlines() if "report.html" not in line) <= 80
    everything = json.loads((results.path / "report.json").read_text())
    assert everything["losses"][0]["before_view"] == pytest.approx(0.1)
    assert everything["parts"][0]["name"] == "path 4 to 8 m"
    assert "Where SPL is lost" in (results.path / "report.html").read_text()
