import pytest

from ippon.guidance.language.grammar.typed import spelt_out


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("find my socks theyre grey", "find my socks they're grey"),
        ("i cant find it", "i can't find it"),
        ("its in the hall", "it's in the hall"),
        ("the bird and its cage", "the bird and its cage"),
        ("find the cat lol", "find the cat"),
        ("bring the towels dear", "bring the towels,"),
        ("find my dear hat", "find my dear hat"),
        ("the kettle's hot, get the pot", "the kettle is hot, get the pot"),
        ("Anna's red scarf", "Anna's red scarf"),
        ("w/ a lid", "with a lid"),
    ],
)
def test_what_is_typed_short_is_spelt_out(typed: str, meant: str) -> None:
    assert spelt_out(typed) == meant
