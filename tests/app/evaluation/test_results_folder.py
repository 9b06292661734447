import dataclasses
import errno
import json
import os

import pytest

from app.errors import UsageError
from app.evaluation.results_folder import RUN_FILE, TABLE_FILE, EvaluationFolder
from ippon.evaluation.row import EpisodeRow

_SETTINGS = {"fixed": {"seed": 0, "robot": "zed"}, "version": "1"}


@pytest.fixture
def folder(tmp_path):
    folder = EvaluationFolder(tmp_path / "out")
    folder.open_for(_SETTINGS)
    return folder


def test_rows_come_back_as_they_were(folder, make_row):
    rows = [make_row(method=m, distance_to_goal_m=float("inf")) for m in ("ippon", "oracle")]
    for row in rows:
        folder.write(row)
    assert list(folder.rows()) == rows
    folder.merge()
    for line in (folder.path / TABLE_FILE).read_text("utf-8").splitlines():
        assert json.loads(line, parse_constant=pytest.fail)["distance_to_goal_m"] is None


def test_the_table_holds_a_row_on_each_line_and_is_enough_for_a_report(folder, make_row):
    rows = (make_row(), make_row(method="oracle", success=False, path_x_m=()))
    for row in rows:
        folder.write(row)
    assert folder.merge() == 2
    lines = (folder.path / TABLE_FILE).read_text().splitlines()
    names = [f.name for f in dataclasses.fields(EpisodeRow)]
    assert [list(json.loads(line)) for line in lines] == [names, names]
    for path in (folder.path / "rows").iterdir():
        path.unlink()
    assert folder.rows() == rows


def test_a_row_counts_as_done_under_its_own_configuration_only(folder, make_row):
    row = make_row(config_hash="one", context="It is in the hall.")
    assert not folder.has(row.episode_id, row.method, "one", row.context)
    folder.write(row)
    assert folder.has(row.episode_id, row.method, "one", row.context)
    assert not folder.has(row.episode_id, "oracle", "one", row.context)
    with pytest.raises(UsageError, match="made with configuration one, this would be two"):
        folder.has(row.episode_id, row.method, "two", row.context)


def test_a_row_with_another_context_is_that_of_another_run(folder, make_row):
    """`--context support` and `--context room` give searches of one name."""
    row = make_row(config_hash="one", context="It is in the hall.")
    folder.write(row)
    with pytest.raises(
        UsageError, match=r"context 'It is in the hall\.', this would be 'I left it"
    ):
        folder.has(row.episode_id, row.method, "one", "I left it on the bed.")


def test_what_a_killed_writer_left_is_no_row(folder, make_row):
    folder.write(make_row())
    (folder.path / "rows" / ".2.bed.0.untold.ippon.json.77").write_text('{"epis')
    assert len(folder.rows()) == 1


def test_other_settings_need_another_folder(folder, make_row):
    other = {"fixed": {"seed": 1, "robot": "zed"}, "version": "1"}
    with pytest.raises(UsageError, match=r"was begun, without .*same options, or delete it"):
        folder.open_for(other)
    folder.write(make_row())
    with pytest.raises(UsageError, match=r"another setup: seed 0 \(now 1\); use another folder"):
        folder.open_for(other)
    folder.open_for({**_SETTINGS, "version": "2"})
    assert folder.settings()["version"] == "2"


def test_settings_that_are_stored_only_where_unusual_are_named_by_what_they_were(folder, make_row):
    folder.write(make_row())
    unusual = {"segmentation_errors": "detector", "mission": {"map": {"fusion": "paper"}}}
    changed = {**_SETTINGS, "fixed": {**_SETTINGS["fixed"], **unusual}}
    with pytest.raises(UsageError, match=r"errors 'paper' \(now 'detector'\)") as raised:
        folder.open_for(changed)
    assert "mission the defaults (now {'map': {'fusion': 'paper'}})" in str(raised.value)


@pytest.mark.parametrize("damaged", ["{", "[]"])
def test_damage_is_named(folder, make_row, damaged):
    (folder.path / RUN_FILE).write_text(damaged)
    with pytest.raises(UsageError, match=r"run\.json is damaged"):
        folder.open_for(_SETTINGS)
    with pytest.raises(UsageError, match=r"run\.json is damaged: .*delete it to continue without"):
        folder.settings()
    folder.write(make_row())
    (path,) = (folder.path / "rows").iterdir()
    values = json.loads(path.read_text())
    del values["spl"]
    path.write_text(json.dumps(values))
    with pytest.raises(UsageError, match="lacks or adds spl; delete it to run that search again"):
        folder.rows()


def test_an_empty_folder_says_how_to_fill_it(tmp_path):
    with pytest.raises(UsageError, match="holds no results; make some with `ippon eval run"):
        EvaluationFolder(tmp_path).rows()


def test_a_failure_is_forgotten_once_the_episode_ran(folder, make_row):
    row = make_row()
    folder.write_error(f"{row.episode_id}.{row.method}", "Traceback")
    assert folder.errors() == ("1.bed.0.untold.ippon",)
    folder.write(row)
    assert folder.errors() == ()


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="cannot write to"):
        EvaluationFolder(tmp_path / "file" / "out").open_for(_SETTINGS)


def test_a_full_disk_is_told_and_costs_one_row(folder, make_row, monkeypatch):
    folder.write(make_row())

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        for write in (
            lambda: folder.write(make_row(episode_id="2.bed.0.untold")),
            lambda: folder.write_error("home 1", "Traceback"),
            folder.merge,
        ):
            with pytest.raises(UsageError, match=r"No space left on device; finished .* are kept"):
                write()
    assert folder.rows() == (make_row(),)
    assert folder.errors() == ()


def test_a_damaged_table_is_named(folder):
    (folder.path / TABLE_FILE).write_text('{"method": ')
    with pytest.raises(UsageError, match=r"episodes\.jsonl is damaged"):
        folder.rows()


def test_two_homes_of_one_name_are_refused_in_one_run(tmp_path):
    folder = EvaluationFolder(tmp_path / "out")
    folder.check_homes(("/a/flat1", "/a/flat2", "1", "floor:1"))
    with pytest.raises(UsageError, match=r"/a/flat1 and /b/flat1 have the same name.*rename one"):
        folder.check_homes(("/a/flat1", "/b/flat1"))
    with pytest.raises(UsageError, match="/a/flat 1 and /b/flat_1 have the same name"):
        folder.check_homes(("/a/flat 1", "/b/flat_1"))
    with pytest.raises(UsageError, match="3 and /a/3 have the same name"):
        folder.check_homes(("3", "/a/3"))
    assert not folder.path.exists()


def test_a_home_of_the_name_of_one_that_has_rows_is_refused(folder, make_row, tmp_path):
    old = tmp_path / "a" / "flat1"
    folder.write(make_row(episode_id="flat1.bed.0.untold", home=str(old)))
    folder.check_homes((f"{old}/", "1"))
    moved = tmp_path / "b" / "flat1"
    moved.mkdir(parents=True)
    with pytest.raises(UsageError, match=f"holds rows of {old}, and {moved} has the same name"):
        folder.check_homes((str(moved),))
    # What the message proposes for a home that was moved.
    old.parent.mkdir()
    old.symlink_to(moved)
    folder.check_homes((str(moved),))


def _with(**hashes):
    configurations = {method: {"hash": h, "trial": {}} for method, h in hashes.items()}
    return {**_SETTINGS, "configurations": configurations}


def test_configurations_of_earlier_methods_are_kept(folder, make_row):
    folder.open_for(_with(ippon="one"))
    folder.open_for(_with(oracle="two"))
    kept = folder.settings()["configurations"]
    assert {method: c["hash"] for method, c in kept.items()} == {"ippon": "one", "oracle": "two"}
    # Without rows nothing depends on what was noted; with rows it must stay.
    folder.open_for(_with(ippon="three"))
    folder.write(make_row(method="ippon", config_hash="three"))
    with pytest.raises(UsageError, match=r"rows of ippon with configuration three, this .* four"):
        folder.open_for(_with(ippon="four"))
    assert folder.settings()["configurations"]["ippon"]["hash"] == "three"
