import logging
import os
from pathlib import Path

import pytest

from app.links.language_model import answer_cache
from app.links.language_model.answer_cache import AnswerCache, CachedAnswer
from ippon.guidance.levels import LabelLevel, Level

ANSWER = CachedAnswer(
    rows=(
        LabelLevel(label="sofa", level=Level.CERTAIN, reason="“on” it"),
        LabelLevel(label="wall", level=Level.AVERAGE, reason=""),
    ),
    prompt="where?",
    reply="sofa: CERTAIN",
)
LABELS = ("sofa", "wall")


def test_round_trip(tmp_path: Path) -> None:
    cache = AnswerCache(tmp_path / "deep" / "er", endpoint="http://a", model="tiny")
    assert cache.load("hat", LABELS) is None
    cache.store("hat", ANSWER)
    assert cache.load("hat", LABELS) == ANSWER
    assert cache.load("bed", LABELS) is None
    assert len(list((tmp_path / "deep" / "er").iterdir())) == 1


def test_other_models_endpoints_and_vocabularies_have_their_own(tmp_path: Path) -> None:
    cache = AnswerCache(tmp_path, endpoint="http://a", model="tiny")
    cache.store("hat", ANSWER)
    assert cache.load("hat", ("wall", "sofa")) is None
    assert AnswerCache(tmp_path, endpoint="http://a", model="big").load("hat", LABELS) is None
    assert AnswerCache(tmp_path, endpoint="http://b", model="tiny").load("hat", LABELS) is None


@pytest.mark.parametrize(
    "text", ["", "[]", "{}", '{"rows": 3}', "\x00", '{"rows": [["sofa", "NEAR"]]}', "[" * 9999]
)
def test_damaged_files_count_as_absent(tmp_path: Path, text: str) -> None:
    cache = AnswerCache(tmp_path, endpoint="http://a", model="tiny")
    cache.store("hat", ANSWER)
    (file,) = tmp_path.iterdir()
    file.write_text(text)
    assert cache.load("hat", LABELS) is None
    cache.store("hat", ANSWER)
    assert cache.load("hat", LABELS) == ANSWER


def test_a_folder_that_cannot_be_written_is_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "file").write_text("")
    cache = AnswerCache(tmp_path / "file" / "x", endpoint="http://a", model="tiny")
    with caplog.at_level(logging.WARNING):
        cache.store("hat", ANSWER)
    assert "the answer was not cached in" in caplog.text


def test_the_oldest_answers_are_removed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(answer_cache, "MAX_FILES", 3)
    cache = AnswerCache(tmp_path, endpoint="http://a", model="tiny")
    for number in range(5):
        cache.store(str(number), ANSWER)
        for file in tmp_path.iterdir():
            os.utime(file, ns=(0, file.stat().st_mtime_ns - 1_000_000))
    kept = [number for number in range(5) if cache.load(str(number), LABELS) is not None]
    assert kept == [2, 3, 4]
