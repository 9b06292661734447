import contextlib
import dataclasses
import json

import pytest

from app.errors import UsageError
from app.evaluation import rerun
from app.evaluation.config import EvaluationConfig
from app.evaluation.errors import EvaluationError
from app.evaluation.rerun import differences, rerun_episode, trial_of_row
from app.evaluation.results_folder import EvaluationFolder
from app.evaluation.run import run_evaluation
from app.evaluation.setup import settings_of, trial_of
from app.messages import keys
from app.messages.control import decode
from app.messages.status import Status
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
        rerun_episode(results.path, "2.bed", "ippon", print)
    with pytest.raises(UsageError, match=r"'1\.bed\.0\.untold' by oracle; there is ippon"):
        rerun_episode(results.path, "1.bed.0.untold", "oracle", print)


def test_a_search_on_another_s_map_names_those_that_can_be_replayed(results, make_row):
    name = "1.hat.0.untold.bed.second"
    results.write(make_row(episode_id=name, kind="second", after="hat"))
    with pytest.raises(UsageError, match=r"that one, 1\.hat\.0\.untold, or .*untold\.bed\.fresh"):
        rerun_episode(results.path, name, "ippon", print)


def test_rows_of_one_search_differ_in_times_only(make_row):
    row = make_row()
    assert differences(row, dataclasses.replace(row, cpu_s=9.0, version="other")) == ()
    assert differences(row, dataclasses.replace(row, spl=0.1, hits=2)) == ("spl", "hits")


def test_a_method_that_is_not_installed_any_more_is_named(results, make_row):
    results.write(make_row(method="mine", robot="habitat", image_width=240))
    with pytest.raises(UsageError, match=r"method of 1\.bed\.0\.untold: no method 'mine'"):
        rerun_episode(results.path, "1.bed.0.untold", "mine", print)


def test_later_searches_of_a_run_by_attribute_are_repeated_in_its_home(
    make_row, monkeypatch, tmp_path
):
    config = EvaluationConfig(out=tmp_path, attributes=True)
    trial = trial_of(config)
    results = EvaluationFolder(tmp_path / "by attribute")
    results.open_for(json.loads(json.dumps(settings_of(config, trial, ("ippon",), "test"))))
    name = "1.hat.0.untold.bed.fresh"
    results.write(make_row(episode_id=name, robot="habitat", image_width=240, kind="fresh"))
    loaded = []

    def load_home(home, *, coloured_mugs):
        loaded.append(coloured_mugs)
        raise EvaluationError("enough")

    monkeypatch.setattr(rerun, "load_home", load_home)
    with pytest.raises(EvaluationError, match="enough"):
        rerun_episode(results.path, name, "ippon", lambda _: None)
    assert loaded == [True]


def test_a_search_by_attribute_is_repeated_with_its_error_rate(make_row, tmp_path):
    config = EvaluationConfig(out=tmp_path, attributes=True, attribute_error_rate=0.2)
    trial = trial_of(config)
    settings = json.loads(json.dumps(settings_of(config, trial, ("ippon",), "test")))
    row = make_row(robot="habitat", image_width=trial.image_width, colour="red")
    assert trial_of_row(settings, row).world.attribute_errors.rate == 0.2
    assert trial_of_row({}, row).world.attribute_errors.rate == 0.0


def test_the_robot_of_a_row_is_known_when_its_file_has_changed(make_row, tmp_path):
    file = tmp_path / "scout.yaml"
    file.write_text(template(dataclasses.replace(ZED, name="scout", camera_height_m=0.6)))
    trial = trial_of(EvaluationConfig(out=tmp_path, robot=str(file), segmentation_errors="paper"))
    method = method_named("ippon")
    row = make_row(
        method="ippon", robot="scout", image_width=320, config_hash=config_hash(trial, method)
    )
    kept = {"configurations": {"ippon": {"trial": dataclasses.asdict(trial)}}}
    file.unlink()
    assert trial_of_row(json.loads(json.dumps(kept)), row) == trial
    with pytest.raises(UsageError, match=r"robot of .* cannot be read: no robot profile 'scout"):
        trial_of_row({}, row)
    kept["configurations"]["ippon"]["trial"]["robot"]["max_depth_m"] = -1.0
    with pytest.raises(UsageError, match="cannot be read"):
        trial_of_row(kept, row)


@pytest.mark.parametrize("errors", ["paper", "detector"])
def test_a_replay_has_the_errors_of_the_run(make_row, errors, tmp_path):
    config = EvaluationConfig(out=tmp_path, segmentation_errors=errors)
    settings = settings_of(config, trial_of(config), ("ippon",), "1")
    row = make_row(method="ippon", robot="habitat", image_width=240)
    assert trial_of_row(settings, row).world.segmentation_errors == errors


def test_a_folder_without_a_word_of_errors_has_those_of_the_paper(make_row):
    row = make_row(method="ippon", robot="habitat", image_width=240)
    assert trial_of_row({}, row).world.segmentation_errors == "paper"


@pytest.mark.slow
@pytest.mark.large
def test_a_replay_is_the_same_search_and_can_be_reviewed(room, tmp_path, observer):
    out = tmp_path / "out"
    run = EvaluationConfig(out=out, homes=(str(room),), objects="hat", robot="zed", image_width=96)
    assert run_evaluation(run, observer).failed == 0
    (row,) = EvaluationFolder(out).rows()
    told = []
    replay = rerun_episode(out, row.episode_id, "ippon", told.append)
    assert replay.differences == ()
    assert [text.split(" for ")[0] for text in told] == ["searching"]
    with contextlib.closing(Recording(replay.session)) as recording:
        statuses = [decode(m.payload, Status) for m in recording.all_messages((keys.STATUS,))]
        seen = {m.key for m in recording.all_messages((keys.COLOR, keys.MAP_KEYFRAME, keys.TF))}
    assert len(statuses) == row.frames
    assert statuses[-1].state == row.ending
    assert statuses[-1].goal.object == "hat"
    assert seen == {keys.COLOR, keys.MAP_KEYFRAME, keys.TF}
    assert json.loads((out / "run.json").read_text())["fixed"]["robot"] == "zed"
