import dataclasses
import json
import os
import shutil
import signal
import time

import pytest

from app.cli.options.evaluation import EvalRun
from app.errors import UsageError
from app.evaluation.results_folder import TABLE_FILE, EvaluationFolder
from app.evaluation.run import catalogue_of, expand_methods, run_evaluation, trial_of
from app.homes import expand_homes
from app.robot_file import template
from ippon.evaluation.methods.method_table import ABLATIONS, METHODS
from ippon.evaluation.row import TIMING_COLUMNS
from ippon.robot import ZED


def test_ranges_of_homes_hold_their_last(room):
    assert expand_homes(["1001:1003", "7,9", str(room), "7"]) == (
        "1001", "1002", "1003", "7", "9", str(room),
    )  # fmt: skip
    assert expand_homes(["floor:2:3,floor:9"]) == ("floor:2", "floor:3", "floor:9")


def test_a_home_that_is_written_in_two_ways_is_searched_once(room):
    assert expand_homes([str(room), f"{room}/", f"{room}/../room"]) == (str(room),)


def test_homes_of_one_name_are_refused_before_anything_starts(room, tmp_path):
    other = tmp_path / "other" / "room"
    shutil.copytree(room, other)
    out = tmp_path / "out"
    with pytest.raises(UsageError, match="have the same name"):
        run_evaluation(EvalRun(out=out, homes=(str(room), str(other))))
    assert not out.exists()


@pytest.mark.parametrize(
    ("homes", "text"),
    [
        (["5:3"], "from a smaller seed to a larger one"),
        (["1:9999999"], "from a smaller seed to a larger one"),
        (["nowhere"], "no home 'nowhere'"),
        ([","], "no homes"),
        (["3:x"], "no home '3:x'"),
        (["3:²"], "no home '3:²'"),
        (["floor:5:3"], "from a smaller seed to a larger one"),
        (["floor:"], "no home 'floor:'.*floor:SEED"),
    ],
)
def test_homes_that_are_none(homes, text):
    with pytest.raises(UsageError, match=text):
        expand_homes(homes)


def test_groups_of_methods():
    assert expand_methods("ippon,ablations,no_bayes") == ("ippon", *ABLATIONS)
    assert expand_methods("all") == tuple(METHODS)
    with pytest.raises(UsageError, match=r"no method 'magic'.*or all, ablations, baselines"):
        expand_methods("ippon,magic")
    with pytest.raises(UsageError, match="no methods; there are ippon"):
        expand_methods(" , ")


def test_options_reach_the_set_up(tmp_path):
    command = EvalRun(
        out=tmp_path, robot="zed", voxel_size_m=0.15, objects="habitat,Alarm Clock", starts=2
    )
    trial = trial_of(command)
    assert (trial.robot.name, trial.image_width) == ("zed", 320)
    assert trial.mission.map.voxel_size_m == 0.15
    catalogue = catalogue_of(command)
    assert catalogue.goals[-1] == "alarm_clock"
    assert catalogue.starts_per_goal == 2
    assert trial.limits.max_time_s == 300.0
    assert catalogue.min_shortest_path_m == 1.0
    longer = dataclasses.replace(command, max_time_s=900.0, min_path_m=8.0)
    assert trial_of(longer).limits.max_time_s == 900.0
    assert catalogue_of(longer).min_shortest_path_m == 8.0
    with pytest.raises(ValueError, match="max_time_s"):
        trial_of(dataclasses.replace(command, max_time_s=0.0))
    with pytest.raises(ValueError, match="image-width lies in 32 to 4096"):
        trial_of(dataclasses.replace(command, image_width=2))


def test_a_robot_of_ones_own_is_measured_with_its_own_body_and_camera(tmp_path):
    file = tmp_path / "scout.yaml"
    own = dataclasses.replace(ZED, name="scout", camera_height_m=0.6, max_depth_m=4.0)
    file.write_text(template(own))
    trial = trial_of(EvalRun(out=tmp_path, robot=str(file)))
    assert (trial.robot.name, trial.robot.camera_height_m) == ("scout", 0.6)
    assert trial.mission.map.max_range_m == 4.0
    assert trial.limits == trial_of(EvalRun(out=tmp_path, robot="zed")).limits
    with pytest.raises(ValueError, match="no robot profile 'nobody': give zed, habitat or a YAML"):
        trial_of(EvalRun(out=tmp_path, robot="nobody"))


def _arguments(out, room, workers=1):
    return (
        "eval", "run", "--out", str(out), "--homes", str(room), "--objects", "chair,hat",
        "--methods", "oracle", "--robot", "zed", "--image-width", "64", "--starts", "4",
        "--workers", str(workers),
    )  # fmt: skip


def _rows(out):
    # A commit between two runs changes the version and nothing else.
    left_out = {*TIMING_COLUMNS, "version"}
    return [
        {k: v for k, v in dataclasses.asdict(row).items() if k not in left_out}
        for row in EvaluationFolder(out).rows()
    ]


@pytest.mark.process
@pytest.mark.slow
def test_one_worker_and_two_write_the_same_rows(launch, room, tmp_path):
    for workers in (1, 2):
        arguments = list(_arguments(tmp_path / f"out{workers}", room, workers))
        arguments[arguments.index("oracle")] = "oracle,ippon"
        child = launch(*arguments, "--max-time-s", "11")
        status, _ = child.finish(240.0)
        assert status == 0, child.log()
    one, two = _rows(tmp_path / "out1"), _rows(tmp_path / "out2")
    assert one == two
    oracle, ippon = ([r for r in one if r["method"] == name] for name in ("oracle", "ippon"))
    assert len(oracle) == len(ippon) >= 6
    assert all(row["success"] for row in oracle)
    assert (tmp_path / "out1" / TABLE_FILE).is_file()


@pytest.mark.process
@pytest.mark.slow
def test_a_killed_run_goes_on_where_it_was(launch, room, tmp_path):
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
    status, _ = launch(*_arguments(out, room)).finish(120.0)
    assert status == 0
    refused = launch(*_arguments(out, room), "--seed", "5")
    status, _ = refused.finish(60.0)
    assert status == 2
    assert "holds results of another set-up: seed 0 (now 5)" in refused.log().replace("\n", " ")


@pytest.mark.process
def test_a_home_without_the_object_is_a_clear_error(launch, room, tmp_path):
    arguments = list(_arguments(tmp_path / "out", room))
    arguments[arguments.index("chair,hat")] = "unicorn"
    child = launch(*arguments)
    status, _ = child.finish(120.0)
    assert status == 2
    assert "these homes have none of these objects within reach" in child.log()


@pytest.mark.process
@pytest.mark.slow
def test_a_home_that_cannot_be_read_is_named_and_the_others_are_searched(room, tmp_path, capsys):
    bad = tmp_path / "bad"
    bad.mkdir()
    (bad / "scene.glb").write_bytes(b"glTF, but not really")
    (bad / "scene.json").write_text("{}")
    out = tmp_path / "out"
    run = EvalRun(
        out=out, homes=(str(bad), str(room)), objects="hat", methods="oracle", robot="zed",
        image_width=64,
    )  # fmt: skip
    assert run_evaluation(run) == 1
    assert str(bad) in capsys.readouterr().err.replace("\n", "")
    assert [row.goal for row in EvaluationFolder(out).rows()] == ["hat"]
    assert EvaluationFolder(out).errors() == ("home bad",)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"workers": 0}, "--workers is at least 1; got 0"),
        ({"limit": 0}, "--limit is at least 1; got 0"),
        ({"second_object": True, "methods": "ippon,oracle"}, "oracle cannot go on to a second"),
        ({"ray": ("a", "b")}, "--ray takes one address; got a, b"),
        ({"objects": "?"}, "no object in"),
    ],
)
def test_what_cannot_be_run_is_refused_before_anything_starts(tmp_path, change, text):
    out = tmp_path / "out"
    with pytest.raises(UsageError, match=text):
        run_evaluation(EvalRun(out=out, **change))
    assert not out.exists()
