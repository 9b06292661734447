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


def test_earlier_results_are_kept(monkeypatch, tmp_path, capsys):
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
    said = capsys.readouterr()
    assert json.loads(said.out) == {"episodes": 2, **dict.fromkeys(MEASURES, 0.5)}
    aside = tmp_path / "habitat.jsonl.aside-1"
    assert aside.read_text("utf-8") == "a day of searches\n"
    assert f"the earlier {out} is now {aside}" in said.err
    with pytest.raises(UsageError, match="cannot write to"):
        search(monkeypatch, tmp_path, lambda: rows)
    with pytest.raises(UsageError, match="does not exist"):
        search(monkeypatch, tmp_path / "none" / "a.jsonl", lambda: rows)
