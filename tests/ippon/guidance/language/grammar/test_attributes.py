import pytest

from ippon.guidance.language.grammar.attributes import attribute_kind, listed_kind


@pytest.mark.parametrize(
    ("word", "kind"),
    [
        ("red", "colour"),
        ("tiny", "size"),
        ("wooden", "material"),
        ("striped", "pattern"),
        ("round", "shape"),
        ("broken", "condition"),
        ("left", "which"),
        ("greasy", "other"),
        ("birthday", None),
        ("kitchen", None),
        ("dinosaur", None),
    ],
)
def test_kinds_of_words_before_a_noun(word, kind):
    assert attribute_kind(word) == kind


def test_only_listed_words_describe_after_a_noun():
    assert listed_kind("greasy") is None
