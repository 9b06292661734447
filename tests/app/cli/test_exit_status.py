"""Exit statuses after a search."""

import re

import pytest

from app.cli.exit_status import exit_status
from app.cli.main import run
from app.messages.status import GoalStatus


@pytest.mark.parametrize(
    ("outcome", "status"), [("found", 0), ("exhausted", 1), ("cancelled", 1), ("out_of_reach", 4)]
)
def test_the_exit_status_tells_a_find_from_one_out_of_reach(outcome, status):
    assert exit_status(GoalStatus(goal_id=7, object="hat", outcome=outcome)) == status


def test_help_names_each_exit_status_of_a_search_that_is_followed(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    with pytest.raises(SystemExit):
        run(["ask", "--help"])
    told = capsys.readouterr().out.split("Exit status 0: ")[1].split("--json")[0]
    assert {"4", "1", "2"} == set(re.findall(r"(\d):", told))
