from ippon.evaluation.methods.rule_share import rule_note, unruled_shares


def test_shares_by_hand(make_row):
    rows = [
        make_row(method="mine", rule_steps=30, unruled_steps=30),
        make_row(method="mine", rule_steps=10, unruled_steps=0),
        make_row(method="nearest_frontier", rule_steps=8, unruled_steps=2),
        make_row(method="ippon", rule_steps=0, unruled_steps=0),
        make_row(method="earlier version"),
    ]
    assert unruled_shares(rows) == {"mine": 0.75, "nearest_frontier": 0.25}


def test_a_method_that_its_rule_did_not_decide_is_told_so():
    assert rule_note("mine", 0.75).startswith("mine: in 75 % of the steps")
    assert "mostly those of that planner" in rule_note("mine", 0.75)
    assert "mostly" not in rule_note("mine", 0.25)
