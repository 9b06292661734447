import pytest

from ippon.memory.lookup import find_instances
from ippon.vocabulary import MATTERPORT_40


def ids(matches):
    return [match.instance.instance_id for match in matches]


def test_words_find_synonyms_plurals_and_kinds(make_instance):
    things = [
        make_instance(1, "sofa", at=(3.0, 1.0, 0.5)),
        make_instance(2, "baseball_cap", source="search"),
        make_instance(3, "keys", source="search"),
        make_instance(4, "plant", at=(3.0, 3.0, 0.5)),
    ]
    assert ids(find_instances(things, "the couches", MATTERPORT_40)) == [1]
    assert ids(find_instances(things, "my hat", MATTERPORT_40)) == [2]
    assert ids(find_instances(things, "keys", MATTERPORT_40)) == [3]
    assert find_instances(things, "wallet", MATTERPORT_40) == ()
    assert len(find_instances(things, "", MATTERPORT_40)) == 4


def test_another_label_that_it_may_have_answers_with_its_probability(make_instance):
    things = [make_instance(1, "stool", alternatives=(("chair", 0.3),))]
    (match,) = find_instances(things, "chair", MATTERPORT_40)
    assert match.probability == pytest.approx(0.3)


def test_what_is_there_comes_first_then_the_surer_then_the_later_seen(make_instance):
    things = [
        make_instance(1, probability=0.99, gone_ns=50, last_seen_ns=40),
        make_instance(2, probability=0.71, last_seen_ns=30),
        make_instance(3, probability=0.95, last_seen_ns=10),
        make_instance(4, probability=0.96, last_seen_ns=20),
    ]
    assert ids(find_instances(things, "chair", MATTERPORT_40)) == [4, 3, 2, 1]


def test_a_text_without_a_word_is_refused(make_instance):
    with pytest.raises(ValueError, match="no object in"):
        find_instances([make_instance()], "?!", MATTERPORT_40)


def test_a_find_is_listed_once_although_the_map_has_a_label_of_its_own_for_it(make_instance):
    hat = make_instance(1, "hat", source="search", size_m=(0.3, 0.3, 0.2))
    clothes = make_instance(2, "clothes", at=(1.05, 1.0, 0.5), size_m=(0.4, 0.3, 0.2))
    sofa = make_instance(3, "sofa", at=(1.0, 1.0, 0.4), size_m=(2.0, 0.9, 0.8))
    beside = make_instance(4, "clothes", at=(1.5, 1.0, 0.5), size_m=(0.4, 0.3, 0.2))
    things = [hat, clothes, sofa, beside]
    assert sorted(ids(find_instances(things, "", MATTERPORT_40))) == [1, 3, 4]
    assert sorted(ids(find_instances(things, "clothes", MATTERPORT_40)))[-2:] == [2, 4]
    named = make_instance(2, "clothes", at=(1.05, 1.0, 0.5), size_m=(0.4, 0.3, 0.2), name="cap")
    assert 2 in ids(find_instances([hat, named], "", MATTERPORT_40))
    gone = make_instance(1, "hat", source="search", size_m=(0.3, 0.3, 0.2), gone_ns=9)
    assert sorted(ids(find_instances([gone, clothes], "", MATTERPORT_40))) == [1, 2]
