"""`ippon eval habitat` without habitat."""

import json
from pathlib import Path

import pytest

from app.cli.evaluation import habitat
from app.cli.options.evaluation import EvalHabitat
from app.errors import UsageError
from app.evaluation.errors import EvaluationError
from app.evaluation.habitat_episodes import MEASURES


def search(monkeypatch, out, episodes):
    def begin(**_):
        yield from episodes()

    monkeypatch.setattr(habitat, "search_data_set", begin)
    return habitat.run_eval_habitat(EvalHabitat(config=Path("c"), python=Path("p"), out=out))


def test_a_search_that_does_not_begin_keeps_earlier_results(monkeypatch, tmp_path, capsys):
    out = tmp_path / "habitat.jsonl"
    out.write_text("a day of searches\n", "utf-8")

    def fail():
        raise EvaluationError("no weights")
        yield

    with pytest.raises(EvaluationError, match="no weights"):
        search(monkeypatch, out, fail)
    with pytest.raises(UsageError, match="has no episode"):
        search(monkeypatch, out, lambda: ())
    assert out.read_text("utf-8") == "a day of searches\n"
    rows = [dict.fromkeys(MEASURES, 0.25), dict.fromkeys(MEASURES, 0.75)]
    assert search(monkeypatch, out, lambda: rows) == 0
    assert [json.loads(line) for line in out.read_text("utf-8").splitlines()] == rows
    assert json.loads(capsys.readouterr().out) == {"episodes": 2, **dict.fromkeys(MEASURES, 0.5)}
    with pytest.raises(UsageError, match="cannot write to"):
        search(monkeypatch, tmp_path, lambda: rows)
    with pytest.raises(UsageError, match="does not exist"):
        search(monkeypatch, tmp_path / "none" / "a.jsonl", lambda: rows)
