from app.messages.status import FindAttribute, FindReport
from app.nodes.console.panels.find_card import find_card
from app.view.words import ENGLISH


def _find(*attributes):
    return FindReport(
        goal_id=1,
        object="coffee_mug",
        position_world=(1.0, 2.0, 0.8),
        size_m=(0.1, 0.1, 0.1),
        probability=0.99,
        voxels=2,
        attributes=list(attributes),
    )


def test_a_find_without_attributes_is_named_in_a_tour_only():
    assert find_card(_find(), ENGLISH, in_tour=False) == ""
    assert "Found: <b>coffee mug</b>" in find_card(_find(), ENGLISH, in_tour=True)


def test_each_attribute_says_what_checked_it_and_what_was_not_checked():
    html = find_card(
        _find(
            FindAttribute(value="red", kind="colour", verdict="right", by="images", seen="red"),
            FindAttribute(value="<b>Anna", kind="owner", verdict="unchecked"),
            FindAttribute(value="large", kind="size", verdict="wrong", by="gemma", seen="small"),
        ),
        ENGLISH,
        in_tour=False,
    )
    assert html == (
        "<ul><li>red: yes (images)</li><li>&lt;b&gt;Anna: not checked</li>"
        "<li>large: no, it is small (gemma)</li></ul>"
    )
