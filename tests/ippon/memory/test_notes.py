"""What people say of things: names that hold in sentences, and labels that are denied."""

import pytest

from ippon.guidance.language.requests.sentence import read_request, search_name
from ippon.memory.lookup import find_instances
from ippon.memory.notes import checked_name, denied_labels, with_names, without_names
from ippon.vocabulary import MATTERPORT_40


@pytest.fixture
def things(make_instance):
    return [
        make_instance(1, "mug", source="search", name="Anna's mug"),
        make_instance(2, "mug", source="search"),
        make_instance(3, "sofa", name="The Beast", alternatives=(("bed", 0.06),)),
    ]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("find Anna's mug", ["Anna's mug"]),
        ("Anna\N{RIGHT SINGLE QUOTATION MARK}s mug, please", ["Anna's mug"]),
        ("find the beast and anna's  mug", ["The Beast", "Anna's mug"]),
        ("find a mug and Anna's mug", ["mug", "Anna's mug"]),
        ("find the mug", ["mug"]),
        ("find Hanna's mug", ["mug"]),
        ("find the mug, not Anna's mug", ["mug"]),
        ("find a mug next to Anna's mug", ["mug"]),
        ("look for Anna's mug", ["Anna's mug"]),
    ],
)
def test_names_are_read_in_sentences(things, text, names):
    sentence, named = without_names(text, things)
    goals = with_names(read_request(sentence).goals, named)
    assert sorted(search_name(goal) for goal in goals) == sorted(names)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("Opas Gießkanne", "find Opas Gießkanne and Anna's mug"),
        ("Opas Gießkanne", "find OPAS GIESSKANNE and Anna's mug"),
        ("Opas Giesskanne", "find my opas gießkanne and Anna's mug"),
        ("J\u00fcrgens mug", "find Ju\u0308rgens mug and Anna's mug"),
        ("Ju\u0308rgens mug", "find J\u00fcrgens mug and Anna's mug"),
        ("\u0130pek's mug", "find \u0130pek's mug and Anna's mug"),
    ],
)
def test_a_name_holds_in_any_spelling_of_its_letters(make_instance, name, text):
    things = [make_instance(1, "hat", name=name), make_instance(2, "mug", name="Anna's mug")]
    assert without_names(text, things) == ("find the hat and the mug", tuple(things))
    (match,) = find_instances(things, text[len("find ") : text.index(" and")], MATTERPORT_40)
    assert match.instance is things[0]


def test_a_name_that_is_denied_or_a_place_stays_one(things):
    sentence, _ = without_names("find the mug, not Anna's mug", things)
    (goal,) = read_request(sentence).goals
    assert [(one.value, one.negated) for one in goal.attributes] == [("Anna", True)]
    assert without_names("find my keys on The Beast", things) == ("find my keys on the sofa", ())


def test_a_name_answers_a_question_alone_and_a_kind_all_of_it(things):
    def ids(text):
        return [one.instance.instance_id for one in find_instances(things, text, MATTERPORT_40)]

    assert ids("Anna's mug") == [1]
    assert ids("my beast") == [3]
    assert ids("the mug") == [1, 2]


def test_what_was_denied_answers_no_question_and_the_rest_gets_its_share(make_instance):
    sofa = make_instance(1, "sofa", alternatives=(("bed", 0.08),), probability=0.9)
    denied = make_instance(
        1, "sofa", alternatives=(("bed", 0.08),), probability=0.9, denied=("sofa",)
    )
    assert (sofa.believed, denied.believed) == ("sofa", "bed")
    assert denied.beliefs[0][1] == pytest.approx(0.8)
    assert find_instances([denied], "sofa", MATTERPORT_40) == ()
    (match,) = find_instances([denied], "bed", MATTERPORT_40)
    assert match.probability == pytest.approx(0.8)
    nothing = make_instance(2, "hat", denied=("hat",))
    assert (nothing.believed, nothing.beliefs) == ("", ())
    assert find_instances([nothing], "", MATTERPORT_40)[0].probability == 0.0


def test_a_name_is_checked(things, make_instance):
    one = things[1]

    def check(name):
        return checked_name(name, one, things, MATTERPORT_40)

    assert check("  Opa's   mug ") == "Opa's mug"
    assert check(" ") == ""
    assert checked_name("anna's mug", things[0], things, MATTERPORT_40) == "anna's mug"
    for name in ("x" * 41, "a\x00b", "!!!", "the ?"):
        with pytest.raises(ValueError, match="the name of a thing has letters"):
            check(name)
    for name in ("mug", "the Mugs", "towel"):
        with pytest.raises(ValueError, match="is a kind of things"):
            check(name)
    with pytest.raises(ValueError, match="is already the name of a mug"):
        check("ANNA'S MUG")


def test_only_what_it_may_be_is_denied_and_only_that_is_taken_back(things):
    beast = things[2]
    assert denied_labels(beast, "sofa", "") == ("sofa",)
    with pytest.raises(ValueError, match="it is not taken for a hat, but for sofa or bed"):
        denied_labels(beast, "hat", "")
    with pytest.raises(ValueError, match="nobody said that it is not a sofa"):
        denied_labels(beast, "", "sofa")
