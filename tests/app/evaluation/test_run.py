import json
import os
import shutil
import signal
import time
from types import SimpleNamespace

import pytest

from app.cli import main
from app.errors import UsageError
from app.evaluation import run
from app.evaluation.config import EvaluationConfig
from app.evaluation.results_folder import TABLE_FILE, EvaluationFolder
from app.evaluation.run import run_evaluation
from ippon.evaluation.episode_generation import ExcludedEpisode


def test_homes_of_one_name_are_refused_before_anything_starts(room, tmp_path, observer):
    other = tmp_path / "other" / "room"
    shutil.copytree(room, other)
    out = tmp_path / "out"
    with pytest.raises(UsageError, match="have the same name"):
        run_evaluation(EvaluationConfig(out=out, homes=(str(room), str(other))), observer)
    assert not out.exists()


def test_rows_of_changed_code_are_not_mixed_with_those_before(tmp_path, monkeypatch):
    codes = {"mine": "mine code 11111111"}
    monkeypatch.setattr(run, "code_of", codes.get)
    row = SimpleNamespace(method="mine", version="ippon 0.1.0 1a2b, mine code 11111111")
    folder = SimpleNamespace(path=tmp_path, has_rows=lambda: True, rows=lambda: [row])
    run._check_code(folder, ["ippon", "mine"])
    codes["mine"] = "mine code 22222222"
    run._check_code(folder, ["ippon"])
    with pytest.raises(UsageError, match="the code of mine has changed since the rows in"):
        run._check_code(folder, ["ippon", "mine"])


def test_rows_of_another_version_of_the_program_are_said_and_kept(tmp_path, observer):
    versions = ["ippon 0.1.0 1a2b, numpy 2.1", "ippon 0.1.0 3c4d, numpy 2.1, mine code 11111111"]
    rows = [SimpleNamespace(version=text) for text in versions]
    folder = SimpleNamespace(path=tmp_path, has_rows=lambda: True, rows=lambda: rows)
    run._tell_other_program(folder, "ippon 0.1.0 3c4d, numpy 2.1", observer)
    (told,) = observer.told
    assert told.startswith(f"1 rows in {tmp_path} were made by another version of the program")
    assert "(ippon 0.1.0 1a2b, numpy 2.1; this is ippon 0.1.0 3c4d, numpy 2.1)" in told
    run._tell_other_program(SimpleNamespace(has_rows=lambda: False), versions[0], observer)
    assert observer.told == [told]


def test_a_rule_that_gave_no_targets_is_said_at_the_end(
    room, tmp_path, observer, make_row, monkeypatch
):
    def search(_workers, folder, _jobs, _observer):
        for method, left in (("nearest_frontier", 10), ("semantic_frontier", 90), ("oracle", 100)):
            folder.write(make_row(method=method, rule_steps=100, unruled_steps=left))
        return 0

    monkeypatch.setattr(run, "_run", search)
    methods = "nearest_frontier,semantic_frontier"
    out = tmp_path / "out"
    config = EvaluationConfig(out=out, homes=(str(room),), objects="chair", methods=methods)
    assert run_evaluation(config, observer).rows == 3
    told = [text for text in observer.told if "its rule gave no target" in text]
    assert [text.split(" of the steps")[0] for text in told] == [
        "nearest_frontier: in 10 %",
        "semantic_frontier: in 90 %",
    ]
    assert observer.errors == told[1:]


def test_start_poses_that_are_left_out_are_counted_without_goals_that_have_too_few(
    tmp_path, observer
):
    dropped = [
        ExcludedEpisode(home="7", goal="hat", start_index=index, reason=reason)
        for index, reason in ((0, "no way"), (2, "starts too near"), (None, "no start left"))
    ]
    workers = SimpleNamespace(each=lambda _, homes: [(home, (["spec"], dropped)) for home in homes])
    folder = EvaluationFolder(tmp_path)
    assert run._list(workers, ["7"], folder, observer) == (["spec"], 0)
    (told,) = observer.told
    assert told.startswith("2 start poses left out: too close to a viewpoint")


def _arguments(out, room):
    return (
        "eval", "run", "--out", str(out), "--homes", str(room), "--objects", "chair,hat",
        "--methods", "oracle", "--robot", "zed", "--image-width", "64", "--starts", "4",
        "--max-time-s", "8", "--workers", "1",
    )  # fmt: skip


@pytest.mark.process
@pytest.mark.slow
def test_a_killed_run_goes_on_where_it_was(launch, room, tmp_path, capsys):
    out = tmp_path / "out"
    child = launch(*_arguments(out, room))
    deadline = time.monotonic() + 200.0
    while not list((out / "rows").glob("*.json")):
        assert child.child.poll() is None, child.log()
        assert time.monotonic() < deadline, child.log()
        time.sleep(0.02)
    os.kill(child.child.pid, signal.SIGKILL)
    child.child.wait()
    before = {p.name: p.stat().st_mtime_ns for p in (out / "rows").glob("*.json")}
    assert json.loads(next((out / "rows").glob("*.json")).read_text())["method"] == "oracle"
    assert not (out / TABLE_FILE).exists()
    again = launch(*_arguments(out, room))
    status, _ = again.finish(240.0)
    assert status == 0, again.log()
    after = {p.name: p.stat().st_mtime_ns for p in (out / "rows").glob("*.json")}
    assert len(after) > len(before)
    assert {name: after[name] for name in before} == before
    assert len(EvaluationFolder(out).rows()) == len(after)
    # A third time there is nothing left to do, and other options are refused.
    assert main.run(list(_arguments(out, room))) == 0
    assert {p.name: p.stat().st_mtime_ns for p in (out / "rows").glob("*.json")} == after
    capsys.readouterr()
    assert main.run([*_arguments(out, room), "--seed", "5"]) == 2
    said = capsys.readouterr().err.replace("\n", " ")
    assert "holds results of another setup: seed 0 (now 5)" in said


@pytest.mark.slow
def test_a_home_without_the_object_is_a_clear_error(room, tmp_path, capsys):
    arguments = list(_arguments(tmp_path / "out", room))
    arguments[arguments.index("chair,hat")] = "unicorn"
    assert main.run(arguments) == 2
    assert "these homes have none of these objects within reach" in capsys.readouterr().err


@pytest.mark.process
@pytest.mark.slow
def test_a_home_that_cannot_be_read_is_named_and_the_others_are_searched(room, tmp_path, observer):
    bad = tmp_path / "bad"
    bad.mkdir()
    (bad / "scene.glb").write_bytes(b"glTF, but not really")
    (bad / "scene.json").write_text("{}")
    out = tmp_path / "out"
    run = EvaluationConfig(
        out=out, homes=(str(bad), str(room)), objects="hat", methods="oracle", robot="zed",
        image_width=64, max_time_s=8.0,
    )  # fmt: skip
    assert run_evaluation(run, observer).failed == 1
    assert str(bad) in observer.errors[0]
    assert [row.goal for row in EvaluationFolder(out).rows()] == ["hat"]
    assert EvaluationFolder(out).errors() == ("home bad",)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"workers": 0}, "--workers is at least 1; got 0"),
        ({"limit": 0}, "--limit is at least 1; got 0"),
        ({"second_object": True, "methods": "ippon,oracle"}, "oracle cannot search for a second"),
        ({"ray": ("a", "b")}, "--ray takes one address; got a, b"),
        ({"objects": "?"}, "no object in"),
    ],
)
def test_what_cannot_be_run_is_refused_before_anything_starts(tmp_path, change, text, observer):
    out = tmp_path / "out"
    with pytest.raises(UsageError, match=text):
        run_evaluation(EvaluationConfig(out=out, **change), observer)
    assert not out.exists()
