import contextlib
import dataclasses
import json
from pathlib import Path

import pytest

from app.cli.options.evaluation import EvalReplay, EvalRun
from app.errors import UsageError
from app.evaluation.replay import _trial, differences, run_replay
from app.evaluation.results_folder import EvaluationFolder
from app.evaluation.run import run_evaluation, trial_of
from app.messages import keys
from app.messages.control import Status, decode
from app.recording.reading.recording import Recording
from app.robot_file import template
from ippon.evaluation.methods.method_table import method_named
from ippon.evaluation.trial import config_hash
from ippon.robot import ZED


@pytest.fixture
def results(tmp_path, make_row):
    folder = EvaluationFolder(tmp_path / "results")
    folder.open_for({"fixed": {}})
    return folder


def test_an_episode_that_is_not_there_is_named(results, make_row):
    results.write(make_row())
    with pytest.raises(UsageError, match=r"no episode '2\.bed'; there is 1\.bed\.0\.untold"):
        run_replay(EvalReplay(folder=results.path, episode="2.bed"))
    with pytest.raises(UsageError, match=r"'1\.bed\.0\.untold' by oracle; there is ippon"):
        run_replay(EvalReplay(folder=results.path, episode="1.bed.0.untold", method="oracle"))


def test_a_search_on_another_s_map_names_those_that_can_be_replayed(results, make_row):
    name = "1.hat.0.untold.bed.second"
    results.write(make_row(episode_id=name, kind="second", after="hat"))
    with pytest.raises(UsageError, match=r"that one, 1\.hat\.0\.untold, or .*untold\.bed\.fresh"):
        run_replay(EvalReplay(folder=results.path, episode=name))


def test_rows_of_one_search_differ_in_times_only(make_row):
    row = make_row()
    assert differences(row, dataclasses.replace(row, cpu_s=9.0, version="other")) == ()
    assert differences(row, dataclasses.replace(row, spl=0.1, hits=2)) == ("spl", "hits")


def test_the_robot_of_a_row_is_known_when_its_file_has_changed(make_row, tmp_path, capsys):
    file = tmp_path / "scout.yaml"
    file.write_text(template(dataclasses.replace(ZED, name="scout", camera_height_m=0.6)))
    trial = trial_of(EvalRun(out=tmp_path, robot=str(file)))
    method = method_named("ippon")
    row = make_row(
        method="ippon", robot="scout", image_width=320, config_hash=config_hash(trial, method)
    )
    kept = {"configurations": {"ippon": {"trial": dataclasses.asdict(trial)}}}
    file.unlink()
    assert _trial(json.loads(json.dumps(kept)), row) == trial
    assert capsys.readouterr().err == ""
    with pytest.raises(
        UsageError, match=r"robot of .* not known any more: no robot profile 'scout"
    ):
        _trial({}, row)
    kept["configurations"]["ippon"]["trial"]["robot"]["max_depth_m"] = -1.0
    with pytest.raises(UsageError, match="not known any more"):
        _trial(kept, row)


@pytest.mark.slow
@pytest.mark.large
def test_a_replay_is_the_same_search_and_can_be_reviewed(room, tmp_path, capsys):
    out = tmp_path / "out"
    run = EvalRun(out=out, homes=(str(room),), objects="hat", robot="zed", image_width=96)
    assert run_evaluation(run) == 0
    (row,) = EvaluationFolder(out).rows()
    capsys.readouterr()
    assert run_replay(EvalReplay(folder=out, episode=row.episode_id)) == 0
    said = capsys.readouterr()
    assert "not the search of the row" not in said.err
    folder = said.out.strip()
    with contextlib.closing(Recording(Path(folder))) as recording:
        statuses = [decode(m.payload, Status) for m in recording.all_messages((keys.STATUS,))]
        seen = {m.key for m in recording.all_messages((keys.COLOR, keys.MAP_KEYFRAME, keys.TF))}
    assert len(statuses) == row.frames
    assert statuses[-1].state == row.ending
    assert statuses[-1].goal.object == "hat"
    assert seen == {keys.COLOR, keys.MAP_KEYFRAME, keys.TF}
    assert json.loads((out / "run.json").read_text())["fixed"]["robot"] == "zed"
