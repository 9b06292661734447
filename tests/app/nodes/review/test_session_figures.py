"""Where a review opens."""

import pytest

from app.nodes.review.session_figures import ReviewSession, TimelineMark, opening_s


def session(*marks, duration_s=60.0):
    return ReviewSession(
        sessions=[], duration_s=duration_s, notes=[], problems=[],
        marks=[TimelineMark(at_s=at_s, kind=kind, text="") for at_s, kind in marks],
    )  # fmt: skip


def test_a_review_opens_at_the_last_find_when_its_effect_is_visible():
    assert opening_s(session((5.0, "query"), (20.0, "found"), (31.0, "found"))) == (
        pytest.approx(31.3)
    )


def test_a_find_at_the_very_end_opens_at_the_end():
    assert opening_s(session((59.9, "found"))) == 60.0


def test_without_a_find_a_review_opens_at_the_end():
    assert opening_s(session((5.0, "query"))) == 60.0
    assert opening_s(session(duration_s=0.0)) == 0.0
