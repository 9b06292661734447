from ippon.guidance.language.goals.goal import ALL, Attribute, Goal, Relation, unchecked


def test_each_thing_that_is_not_used_is_told():
    white = Attribute(kind="colour", value="white")
    goal = Goal(
        object="mug",
        display="red mug",
        attributes=(
            Attribute(kind="colour", value="red"),
            Attribute(kind="condition", value="broken", negated=True),
            Attribute(kind="owner", value="Anna"),
        ),
        count=ALL,
        relations=(
            Relation(relation="next to", place="sink", attributes=(white,)),
            Relation(relation="in", place="bedroom", negated=True),
        ),
        refers_to="other",
    )
    owner, first, *others = unchecked(goal)
    assert owner == "whose it is cannot be seen (“Anna”): any mug counts"
    assert first.startswith("“not broken” is checked only by a model that takes images")
    assert first.endswith("without one, any mug counts")
    assert others == [
        "“next to white sink” guides the search, but a find is not checked for it yet",
    ]


def test_a_plain_goal_has_nothing_to_tell():
    assert unchecked(Goal(object="hat", display="hat", context="on the sofa")) == ()
