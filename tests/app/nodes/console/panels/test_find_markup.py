from app.messages.status import FindAttribute, FindReport
from app.nodes.console.panels.find_markup import counted_find, counted_head, find_card
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


def test_a_find_is_named_where_it_is_one_of_several():
    assert find_card(_find(), ENGLISH) == ""
    html = find_card(_find(), ENGLISH, name="<b>mug 2")
    assert "Found: <b>&lt;b&gt;mug 2</b>" in html


def test_what_was_found_so_far_says_what_is_confirmed_and_what_is_not_listed():
    html = counted_head(["<b>chair 1", "chair 3"], 2, ENGLISH)
    assert "Confirmed: &lt;b&gt;chair 1, chair 3" in html
    assert "2 more wait" in html
    assert "wait" not in counted_head([], 0, ENGLISH)
    assert "at (1.2, -3.0) m, z = 0.4 m" in counted_find("chair 1", (1.24, -3.0, 0.4), ENGLISH)


def test_each_attribute_says_what_checked_it_and_what_was_not_checked():
    html = find_card(
        _find(
            FindAttribute(value="red", kind="colour", verdict="right", by="images", seen="red"),
            FindAttribute(value="<b>Anna", kind="owner", verdict="unchecked"),
            FindAttribute(value="large", kind="size", verdict="wrong", by="gemma", seen="small"),
        ),
        ENGLISH,
    )
    assert html == (
        "<ul><li>red: yes (images)</li><li>&lt;b&gt;Anna: not checked</li>"
        "<li>large: no, it is small (gemma)</li></ul>"
    )
