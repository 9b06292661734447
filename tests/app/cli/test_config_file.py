import re

import pytest

from app.cli.config_file import beyond_flags, read_config
from app.cli.main import _with_config_file, parse, run
from app.cli.nodes.navigate import _config_of
from app.cli.options.evaluation import EvalRun
from app.cli.options.nodes import Navigate
from app.errors import UsageError


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "search.yaml"
    path.write_text(
        "mission:\n  map: {voxel_size_m: 0.05, max_range_m: 3}\n  planner: {step_budget_s: 1e-1}\n"
        "hold_find_s: 2\nseed: 4\n"
    )
    return path


def _command(*arguments):
    return _with_config_file(parse(arguments), arguments)


def test_the_file_s_values_stand_below_the_flags(file):
    command = _command("navigate", "--config", str(file), "--seed", "9")
    assert (command.seed, command.voxel_size_m, command.step_budget_s) == (9, 0.05, 0.1)
    command = _command("demo", "--config", str(file), "--voxel-size-m", "0.2")
    assert (command.seed, command.voxel_size_m) == (4, 0.2)
    command = _command("eval", "run", "--out", "x", "--config", str(file)).command
    assert (command.seed, command.voxel_size_m) == (0, 0.05)


def test_a_robot_goes_on_after_a_crash_where_flag_or_file_say_so(tmp_path):
    for said in (True, False):
        path = tmp_path / f"{said}.yaml"
        path.write_text(f"resume: {str(said).lower()}\n")
        given = ("navigate", "--map", "home.map", "--config", str(path))
        assert _command(*given).resume is said
        assert _command(*given, "--resume").resume is True
        assert _command(*given, "--no-resume").resume is False
        assert beyond_flags(Navigate, read_config(path)) == {}


def test_what_has_no_flag_is_left_for_the_command(file):
    rest = beyond_flags(Navigate, read_config(file))
    assert rest == {"mission": {"map": {"max_range_m": 3}}, "hold_find_s": 2}


def test_a_file_with_nothing_but_flags_leaves_nothing():
    assert beyond_flags(EvalRun, {"mission": {"map": {"voxel_size_m": 0.05}}}) == {}


def test_a_field_that_is_set_elsewhere_names_its_flag(tmp_path):
    file = tmp_path / "c.yaml"
    file.write_text("profile: zed\n")
    with pytest.raises(UsageError, match="profile: set it with --profile"):
        read_config(file)


def test_config_prints_what_it_reads_and_what_differs(file, tmp_path, capsys):
    assert run(["config"]) == 0
    printed = tmp_path / "all.yaml"
    printed.write_text(capsys.readouterr().out)
    assert run(["config", str(printed)]) == 0
    assert capsys.readouterr().out == "no field differs from its default\n"
    assert run(["config", str(file)]) == 0
    assert "mission.map.voxel_size_m: 0.05 (default 0.1)\n" in capsys.readouterr().out


@pytest.mark.parametrize("where", ["robot", "here"])
def test_an_unchanged_printed_file_changes_nothing(where, tmp_path, capsys):
    assert run(["config"]) == 0
    printed = tmp_path / "all.yaml"
    printed.write_text(capsys.readouterr().out)
    profile = tmp_path / "robot.yaml"
    assert run(["profile"]) == 0
    text = capsys.readouterr().out
    for name, value in (("min_depth_m", 0.4), ("max_depth_m", 3.0), ("clock_offset_ms", 60)):
        text = re.sub(rf"{name}: \S+", f"{name}: {value}", text)
    profile.write_text(text)
    given = ("navigate", "--profile", str(profile), "--segmentation.where", where)
    plain, _, _ = _config_of(_command(*given), None)
    assert plain.mission.map.max_range_m == 3.0
    assert plain.mission.planner.step_budget_s == 0.04
    assert plain.camera_clock_offset_s == 0.06
    assert _config_of(_command(*given, "--config", str(printed)), None)[0] == plain


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("command_hz", "0"),
        ("command_hz", "-5"),
        ("stale_s", ".nan"),
        ("stale_s", ".inf"),
        ("stale_s", "60"),
        ("lost_s", ".nan"),
        ("heatmap_lost_s", "0"),
        ("keyframe_every_s", "-1"),
        ("look_every_s", "-1"),
        ("max_queue", "0"),
        ("hold_find_s", ".nan"),
        ("labels", "[]"),
        ("labels", "[chair, chair]"),
        ("labels", "[chair, ' ']"),
        ("mission.confirm_steps", "-3"),
        ("mission.map.voxel_size_m", ".inf"),
        ("mission.planner.view.heading_stride", "0"),
        ("mission.follower.stop_margin_m", "-1"),
        ("mission.size_check.unsure_factor", "-1"),
        ("mission.exhaustion.idle_gain", ".nan"),
    ],
)
def test_a_value_out_of_range_ends_with_status_2(name, value, tmp_path, capsys):
    *groups, last = name.split(".")
    text = f"{last}: {value}"
    for group in reversed(groups):
        text = f"{group}: {{{text}}}"
    file = tmp_path / "c.yaml"
    file.write_text(text)
    assert run(["config", str(file)]) == 2
    assert name in capsys.readouterr().err


@pytest.mark.parametrize("command", [("config",), ("navigate", "--config"), ("demo", "--config")])
def test_a_misspelt_field_ends_with_status_2(command, tmp_path, capsys):
    file = tmp_path / "c.yaml"
    file.write_text("mission: {map: {voxel_sise_m: 0.1}}\n")
    assert run([*command, str(file)]) == 2
    error = capsys.readouterr().err
    assert "mission.map.voxel_sise_m: no field" in error
    assert "did you mean mission.map.voxel_size_m?" in error
