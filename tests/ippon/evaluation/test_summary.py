import math

import pytest

from ippon.evaluation.summary import (
    by_method,
    compare,
    context_effects,
    losses,
    parts,
    second_object_effects,
    singles,
    spl_by_goal,
    summarise,
)


@pytest.fixture
def rows(make_row):
    """Three episodes in two homes by two methods, with round figures."""
    ids = ("1.bed.0.untold", "1.tv.0.untold", "2.bed.0.untold")
    figures = {
        "nearest_frontier": [(True, 0.2, 1), (False, 0.0, 0), (True, 0.4, 0)],
        "ippon": [(True, 0.6, 0), (True, 0.3, 2), (True, 0.6, 1)],
    }
    return [
        make_row(
            episode_id=name, home=name[0], goal=name.split(".")[1], method=method,
            success=success, spl=spl, soft_spl=spl + 0.1, hits=hits,
            failure="none" if success else "false_stop",
            frames=100 * (k + 1), planner_ms_p95=10.0 * (k + 1), time_s=60.0, cpu_s=5.0 + k,
        )
        for method, of in figures.items()
        for k, (name, (success, spl, hits)) in enumerate(zip(ids, of, strict=True))
    ]  # fmt: skip


def test_figures_by_hand(rows):
    ippon, frontier = summarise(rows)
    assert (ippon.method, ippon.episodes, ippon.homes) == ("ippon", 3, 2)
    assert ippon.success == 1.0
    # Three of three do not show that every search succeeds.
    assert ippon.success_ci95 == pytest.approx((0.4385, 1.0), abs=1e-4)
    assert ippon.spl == pytest.approx(0.5)
    assert ippon.soft_spl == pytest.approx(0.6)
    assert ippon.hits == pytest.approx(1.0)
    weighted = 100 * 10 + 200 * 20 + 300 * 30
    assert ippon.planner_ms_p95 == pytest.approx(weighted / 600)
    assert ippon.realtime_factor == pytest.approx(180.0 / 18.0)
    # Home 1 has mean 0.45, home 2 has 0.6: the resampled means lie between them.
    assert ippon.spl_ci95 == pytest.approx((0.45, 0.6))
    assert frontier.success == pytest.approx(2 / 3)
    assert frontier.spl == pytest.approx(0.2)
    assert frontier.failures == {"false_stop": 1}
    assert frontier.given_up == {}


def test_failures_that_ended_before_their_time_are_counted_by_cause(make_row):
    ends = [
        ("never_seen", "exhausted"), ("never_seen", "time"), ("seen_and_missed", "exhausted"),
        ("false_stop", "found"), ("never_seen", "exhausted"), ("none", "found"),
    ]  # fmt: skip
    rows = [
        make_row(success=failure == "none", failure=failure, ending=ending)
        for failure, ending in ends
    ]
    (one,) = summarise(rows)
    assert one.failures == {"never_seen": 3, "seen_and_missed": 1, "false_stop": 1}
    assert one.given_up == {"never_seen": 2, "seen_and_missed": 1}


def test_pairs_by_hand(rows):
    (c,) = compare(rows)
    assert c.method == "nearest_frontier"
    assert c.spl.pairs == 3
    assert c.spl.mean == pytest.approx(0.3)
    assert c.spl_ratio.value == pytest.approx(0.5 / 0.2)
    # SPL of home 1 sums to 0.9 and 0.2, of home 2 to 0.6 and 0.4: the ends of what is resampled.
    assert c.spl_ratio.ci95 == pytest.approx((0.6 / 0.4, 0.9 / 0.2))
    assert c.find_s_ratio.value == pytest.approx(1.0)
    assert c.success.mean == pytest.approx(1 / 3)
    assert c.success_p == 1.0
    # Differences of the homes: 0.4 + 0.3 and 0.2; of four sign patterns two are as extreme.
    assert c.spl.p == pytest.approx(0.5)


def test_time_to_the_find_counts_failures_as_endless(make_row):
    def search(method, number, *, success, time_s):
        name = f"{number}.bed.0.untold"
        return make_row(episode_id=name, method=method, success=success, time_s=time_s)

    rows = [
        *(search("ippon", k, success=k < 3, time_s=100.0 * k) for k in range(1, 4)),
        *(search("oracle", k, success=k == 2, time_s=50.0 * k) for k in range(1, 4)),
    ]
    ippon, oracle = summarise(rows)
    assert ippon.find_s == 200.0
    assert oracle.find_s is None
    assert summarise([rows[0], rows[2]])[0].find_s is None
    assert summarise(rows[:2])[0].find_s == 150.0
    # Both succeed in the second search alone: 100 s against 200 s.
    (c,) = compare(rows)
    assert c.find_s_ratio.value == pytest.approx(0.5)
    assert c.find_s_ratio.ci95 is None
    assert compare([rows[0], rows[3]])[0].find_s_ratio is None


def test_only_common_episodes_are_compared(rows, make_row):
    rows.append(make_row(episode_id="9.bed.0.untold", home="9", method="oracle", spl=1.0))
    assert [c.method for c in compare(rows)] == ["nearest_frontier"]


def test_searches_with_different_contexts_are_not_compared(make_row):
    told = make_row(method="ippon", context="It is in the hall.")
    other = make_row(method="ippon (other)", context="I left it on the bed.")
    assert compare([told, other]) == ()
    assert len(compare([told, make_row(method="oracle", context=told.context)])) == 1


def test_nothing_is_compared_without_the_reference(make_row):
    assert compare([make_row(method="oracle")]) == ()


def test_methods_stand_in_their_order_and_strangers_last(make_row):
    rows = [make_row(method=m) for m in ("oracle", "new", "no_bayes", "ippon")]
    assert list(by_method(rows)) == ["ippon", "no_bayes", "oracle", "new"]


def test_context_is_paired_with_the_same_search_untold(make_row):
    told = {"context": "I left it on the sofa.", "goal": "hat"}
    rows = [
        make_row(goal="hat", spl=0.2, home="1"),
        make_row(**told, spl=0.5, home="1"),
        make_row(goal="hat", spl=0.4, home="2"),
        make_row(**told, spl=0.7, home="2"),
        make_row(**told, spl=1.0, home="3"),
        # For the red hat alone, not the same search.
        make_row(goal="hat", colour="red", spl=0.9, home="1"),
    ]
    (effect,) = context_effects(rows)
    assert effect.difference.pairs == 2
    assert (effect.spl_with, effect.spl_without) == (pytest.approx(0.6), pytest.approx(0.3))
    assert effect.ratio.value == pytest.approx(2.0)
    assert effect.ratio.ci95 == pytest.approx((1.75, 2.5), abs=1e-9)
    assert effect.difference.mean == pytest.approx(0.3)


def test_a_context_is_paired_with_the_search_for_the_same_colour(make_row):
    rows = [
        make_row(colour=colour, context=context, spl=spl)
        for colour, context, spl in (
            ("red", "on the table", 0.9), ("red", "", 0.4), ("blue", "on the sofa", 0.7),
            ("blue", "", 0.2),
        )
    ]  # fmt: skip
    (effect,) = context_effects(rows)
    assert effect.spl_without == pytest.approx(0.3)
    assert effect.difference.ci95 == (pytest.approx(0.5), pytest.approx(0.5))


def test_a_second_object_is_paired_with_a_fresh_search_from_the_same_place(make_row):
    def pair(number, *, second, fresh, **values):
        name = f"{number}.hat.0.untold.bed"
        kept = {"home": str(number), "goal": "bed", "after": "hat", **values}
        return [
            make_row(episode_id=f"{name}.second", kind="second", spl=second, **kept),
            make_row(episode_id=f"{name}.fresh", kind="fresh", spl=fresh, **kept),
        ]

    rows = [
        make_row(),
        *pair(1, second=0.9, fresh=0.4),
        *pair(2, second=0.7, fresh=0.6),
        # Beside the bed already, or cut off from it: nothing to compare.
        *pair(3, second=1.0, fresh=0.0, shortest_path_m=0.05),
        *pair(4, second=0.0, fresh=0.0, shortest_path_m=math.inf),
    ]
    (effect,) = second_object_effects(rows)
    assert effect.difference.pairs == 2
    assert (effect.spl_with, effect.spl_without) == (pytest.approx(0.8), pytest.approx(0.5))
    assert effect.ratio.value == pytest.approx(1.6)
    assert singles(rows) == rows[:1]
    assert context_effects(rows) == ()


def test_goals_have_their_own_means(rows):
    table = spl_by_goal(rows)
    assert list(table) == ["bed", "tv"]
    assert table["bed"]["ippon"] == (pytest.approx(0.6), 2)
    assert table["tv"]["nearest_frontier"] == (0.0, 1)


def test_there_is_no_ratio_to_a_method_that_finds_nothing(make_row):
    rows = [make_row(spl=0.6), make_row(method="oracle", spl=0.0, success=False)]
    assert [one.spl_ratio for one in compare(rows)] == [None]
    pair = [make_row(context="on the bed", spl=0.5), make_row(spl=0.0)]
    assert [one.ratio for one in context_effects(pair)] == [None]


def test_parts_by_hand(make_row):
    rows = [
        make_row(goal="bed", shortest_path_m=3.9, spl=0.8),
        make_row(goal="bed", shortest_path_m=8.0, spl=0.0, success=False),
        make_row(goal="mug", shortest_path_m=math.inf, spl=0.4),
        make_row(goal="mug", shortest_path_m=4.0, spl=0.6, method="greedy_nbv"),
    ]
    found = {(p.name, p.method): (p.episodes, p.success, p.spl) for p in parts(rows)}
    assert found == {
        ("Habitat's objects", "ippon"): (2, 0.5, pytest.approx(0.4)),
        ("other objects", "ippon"): (1, 1.0, 0.4),
        ("other objects", "greedy_nbv"): (1, 1.0, 0.6),
        ("path below 4 m", "ippon"): (1, 1.0, 0.8),
        ("path 4 to 8 m", "greedy_nbv"): (1, 1.0, 0.6),
        ("path 8 m and more", "ippon"): (2, 0.5, pytest.approx(0.2)),
    }


def test_losses_and_spl_sum_to_one(make_row):
    rows = [
        make_row(spl=0.5, seen_spl=0.9, mapped_spl=0.8, reached_spl=0.6),
        # Seen, and then a stop at something else.
        make_row(spl=0.0, success=False, failure="false_stop", seen_spl=0.7),
        # Never seen, before a stop and before time ran out.
        make_row(spl=0.0, success=False, failure="false_stop", first_seen_s=-1.0),
        make_row(spl=0.0, success=False, failure="never_seen", first_seen_s=-1.0),
        # Found at the edge of what counts as at the object: no cluster was at it.
        make_row(spl=0.4, seen_spl=0.5),
    ]
    (one,) = losses(rows)
    assert (one.method, one.episodes) == ("ippon", 5)
    assert one.before_view == pytest.approx((0.1 + 0.3 + 0.5) / 5)
    assert one.to_map == pytest.approx(0.1 / 5)
    assert one.to_reach == pytest.approx(0.2 / 5)
    assert one.to_stop == pytest.approx((0.1 + 0.1) / 5)
    assert one.false_stops == pytest.approx((0.7 + 1.0) / 5)
    assert one.other_failures == pytest.approx(1.0 / 5)
    lost = (
        one.before_view + one.to_map + one.to_reach + one.to_stop
        + one.false_stops + one.other_failures
    )  # fmt: skip
    assert lost + sum(row.spl for row in rows) / 5 == pytest.approx(1.0)


def test_rows_of_an_earlier_version_do_not_say_where_spl_was_lost(make_row):
    assert losses([make_row(), make_row(episode_id="2", seen_spl=0.9)]) == ()
