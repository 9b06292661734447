import pytest

from app.cli.config_file import beyond_flags, read_config
from app.cli.main import _with_config_file, parse, run
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


@pytest.mark.parametrize("command", [("config",), ("navigate", "--config"), ("demo", "--config")])
def test_a_misspelt_field_ends_with_status_2(command, tmp_path, capsys):
    file = tmp_path / "c.yaml"
    file.write_text("mission: {map: {voxel_sise_m: 0.1}}\n")
    assert run([*command, str(file)]) == 2
    error = capsys.readouterr().err
    assert "mission.map.voxel_sise_m: no field" in error
    assert "did you mean mission.map.voxel_size_m?" in error
