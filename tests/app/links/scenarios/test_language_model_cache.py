"""Answers of a language model that are kept on disk."""

import sys
from pathlib import Path
from typing import Any

import pytest

from ippon.guidance.levels import Level
from ippon.vocabulary import MATTERPORT_40
from tests.app.links.conftest import KEY, OBJECT, Make, is_prior


def test_answers_are_cached_by_prompt_and_model(
    chat_server: Any, speak: Any, make_model: Make, tmp_path: Path
) -> None:
    chat_server.script = speak(OBJECT)
    cache = tmp_path / "levels"
    first = make_model(cache_dir=cache).levels("hat", "on the sofa", MATTERPORT_40)
    model = make_model(cache_dir=cache)
    second = model.levels("hat", "on the sofa", MATTERPORT_40)
    assert len(chat_server.requests) == 1
    assert (first.from_cache, second.from_cache) == (False, True)
    assert second.guidance == first.guidance
    assert (second.prompt, second.reply) == (first.prompt, first.reply)
    model.levels("hat", "on the bed", MATTERPORT_40)
    make_model(cache_dir=cache, model="other").levels("hat", "on the sofa", MATTERPORT_40)
    assert len(chat_server.requests) == 3
    kept = "".join(file.read_text() for file in cache.iterdir())
    assert KEY not in kept


def test_a_damaged_cache_is_asked_again(
    chat_server: Any, speak: Any, make_model: Make, tmp_path: Path
) -> None:
    chat_server.script = speak(OBJECT)
    make_model(cache_dir=tmp_path).levels("hat", "", MATTERPORT_40)
    (file,) = tmp_path.iterdir()
    for damage in ("", "[]", "{}", file.read_text().replace("NEAR", "HERE"), "\x00"):
        file.write_text(damage)
        answer = make_model(cache_dir=tmp_path).levels("hat", "", MATTERPORT_40)
        assert not answer.from_cache
        assert {row.level for row in answer.guidance.rows} == {Level.NEAR}
    assert make_model(cache_dir=tmp_path).levels("hat", "", MATTERPORT_40).from_cache


def test_a_cache_that_cannot_be_written_costs_nothing(
    chat_server: Any, speak: Any, make_model: Make, tmp_path: Path
) -> None:
    chat_server.script = speak(OBJECT)
    (tmp_path / "file").write_text("")
    answer = make_model(cache_dir=tmp_path / "file" / "levels").levels("hat", "", MATTERPORT_40)
    assert not answer.failed


def test_a_failure_is_not_cached(
    chat_server: Any, speak: Any, reply_with: Any, make_model: Make, tmp_path: Path
) -> None:
    chat_server.script = reply_with(500, b"")
    model = make_model(cache_dir=tmp_path)
    for _ in range(5):
        answer = model.levels("hat", "", MATTERPORT_40)
        assert is_prior(answer)
        assert answer.failed == "HTTP 500"
    assert len(chat_server.requests) == 10
    chat_server.script = speak(OBJECT)
    assert not model.levels("hat", "", MATTERPORT_40).failed


@pytest.mark.benchmark
def test_speed_of_the_cache(
    chat_server: Any,
    speak: Any,
    make_model: Make,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    chat_server.script = speak(OBJECT)
    model = make_model(cache_dir=tmp_path)
    model.levels("hat", "", MATTERPORT_40)
    times = sorted(model.levels("hat", "", MATTERPORT_40).elapsed_ms for _ in range(30))
    assert list(tmp_path.iterdir())
    with capsys.disabled():
        sys.stdout.write(f"\nlevels from the cache: {times[15]:.2f} ms\n")
