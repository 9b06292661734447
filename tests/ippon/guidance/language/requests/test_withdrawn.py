import pytest

from ippon.guidance.language.requests.sentence import read_request


@pytest.mark.parametrize(
    "sentence",
    [
        "find the mug. Never mind.",
        "find the mug, never mind, I found it",
        "find the mug. Found it!",
        "find the mug. Forget that.",
        "find my keys... stop",
        "find my keys, on second thought don't bother",
        "find the mug, no need any more",
    ],
)
def test_what_takes_a_request_back_is_asked_about(sentence: str) -> None:
    assert read_request(sentence).doubtful


@pytest.mark.parametrize(
    "sentence",
    [
        "do not under any circumstances bring me the knife",
        "under no circumstances fetch the scissors",
        "I do not want you to find my phone",
        "cancel finding my keys",
        "I didn't say find the knife, I said find the fork",
        "wait, don't find the mug",
        "you can't bring the knife",
        "I'd rather you didn't bring the knife",
        "the doctor said not to bring the pills",
        "the knife must not be brought",
        "nobody should bring the knife",
    ],
)
def test_what_shall_not_be_searched_for_is_asked_about(sentence: str) -> None:
    assert read_request(sentence).doubtful


@pytest.mark.parametrize(
    "sentence",
    [
        "I can't find my keys",
        "please don't forget to bring the mug",
        "find the mug, don't get the plate",
        "I don't want to bother you but can you find my keys",
        "find my keys, nobody has found them",
        "not the knife, bring the fork",
        "don't search downstairs for my bag",
    ],
)
def test_other_denials_are_no_reason_to_ask(sentence: str) -> None:
    assert not read_request(sentence).doubtful
