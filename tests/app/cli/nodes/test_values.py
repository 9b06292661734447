import pytest

from app.cli import main


@pytest.mark.parametrize(
    "command",
    [
        ("sim", "--home", "3", "--seed", "-1"),
        ("demo", "--home", "3", "--seed", "-1"),
        ("navigate", "--seed", "-1"),
    ],
)
def test_a_negative_seed_is_refused_in_a_sentence(command, capsys):
    assert main.run(command) == 2
    assert "a seed is a whole number from 0; got -1" in capsys.readouterr().err
