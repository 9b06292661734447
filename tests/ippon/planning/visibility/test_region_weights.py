"""What is painted weighs what a viewpoint looks at, and turns it there."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from ippon.planning.visibility.region_weights import (
    RegionWeights,
    Stroke,
    WeightGrid,
    painted_corners,
)
from ippon.planning.visibility.view_config import RegionConfig
from ippon.planning.visibility.viewpoint_gain import ViewChoice, ViewSums, choose_view

CONFIG = RegionConfig()
AHEAD = Stroke(kind="look_here", points=((2.0, 0.0),), radius_m=0.7)
HEADINGS = np.linspace(0.0, 2.0 * math.pi, 8, endpoint=False)
FAR = np.full(8, 5.0)


def test_the_weight_is_1_without_strokes():
    weights = RegionWeights(CONFIG, ())
    assert (weights.at(np.random.default_rng(0).normal(size=(50, 2)) * 20.0) == 1.0).all()


def test_a_later_stroke_lies_over_an_earlier_one():
    over = Stroke(kind="not_here", points=((2.0, 0.0),), radius_m=0.3)
    weights = RegionWeights(CONFIG, (AHEAD, over))
    at = weights.at(np.array([[2.0, 0.0], [2.5, 0.0], [9.0, 9.0]]))
    assert at.tolist() == [CONFIG.avoided_weight, CONFIG.preferred_weight, 1.0]


def test_a_cell_has_the_weight_of_the_last_stroke_whose_brush_covers_its_centre():
    generator = np.random.default_rng(1)
    strokes = [
        Stroke(
            kind="not_here" if k % 2 else "look_here",
            points=tuple(map(tuple, generator.uniform(-4.0, 4.0, (5, 2)))),
            radius_m=float(generator.uniform(0.1, 3.0)),
        )
        for k in range(6)
    ]
    low, high = painted_corners(strokes)
    cells = np.stack(np.meshgrid(*(np.arange(n) for n in ((high - low) / 0.1).astype(int))), -1)
    centres = low + (cells + 0.5) * 0.1
    expected = np.ones(centres.shape[:-1])
    for stroke in strokes:
        weight = CONFIG.avoided_weight if stroke.kind == "not_here" else CONFIG.preferred_weight
        for point in stroke.points:
            expected[((centres - point) ** 2).sum(axis=-1) <= stroke.radius_m**2] = weight
    assert len(np.unique(expected)) == 3
    assert (RegionWeights(CONFIG, strokes).at(centres) == expected).all()


def test_other_rooms_leave_what_is_painted():
    rooms = WeightGrid(cell_m=0.5, origin=np.array([3, 0]), weights=np.full((2, 1), 0.2))
    painted = RegionWeights(CONFIG, (AHEAD,))
    at = np.array([[1.7, 0.3], [9.0, 9.0]])
    assert (
        painted.with_rooms(rooms).at(at).tolist()
        == RegionWeights(CONFIG, (AHEAD,), rooms).at(at).tolist()
    )
    assert painted.with_rooms(rooms).with_rooms(None).at(at).tolist() == painted.at(at).tolist()


def test_weights_of_rooms_are_multiplied_with_painted_ones():
    rooms = WeightGrid(
        cell_m=0.5, origin=np.array([2, -1]), weights=np.array([[3.0, 1.0], [1.0, 0.2]])
    )
    at = np.array([[1.2, -0.4], [1.7, 0.3], [0.2, 0.2], [2.4, 0.0]])
    assert rooms.at(at).tolist() == [3.0, 0.2, 1.0, 1.0]
    both = RegionWeights(CONFIG, (AHEAD,), rooms).at(at)
    assert both.tolist() == pytest.approx([3.0, 1.2, 1.0, 6.0])
    empty = WeightGrid(cell_m=0.5, origin=np.zeros(2, np.int64), weights=np.zeros((0, 0)))
    assert empty.at(at).tolist() == [1.0] * 4


def test_only_the_direction_of_the_region_is_weighed():
    ahead, _ = RegionWeights(CONFIG, (AHEAD,)).ahead(np.zeros(2), HEADINGS, FAR)
    assert ahead[0] > 2.0
    assert (ahead[2:7] == 1.0).all()


def test_the_floor_behind_a_wall_does_not_count():
    near = np.full(8, 1.0)
    ahead, _ = RegionWeights(CONFIG, (AHEAD,)).ahead(np.zeros(2), HEADINGS, near)
    assert (ahead == 1.0).all()


def test_not_here_is_worth_less_than_any_threshold():
    everywhere = Stroke(kind="not_here", points=((0.0, 0.0),), radius_m=6.0)
    ahead, painted = RegionWeights(CONFIG, (everywhere,)).ahead(np.zeros(2), HEADINGS, FAR)
    np.testing.assert_array_equal(ahead, painted)
    assert ahead == pytest.approx(CONFIG.avoided_weight)


def test_a_room_that_was_denied_is_worth_less_but_not_explored():
    room = WeightGrid(cell_m=20.0, origin=np.array([-1, -1]), weights=np.full((2, 2), 0.05))
    weights, painted = RegionWeights(CONFIG, (), room).ahead(np.zeros(2), HEADINGS, FAR)
    assert weights == pytest.approx(0.05)
    assert (painted == 1.0).all()
    sums = ViewSums(
        known=np.full((8, 2), 2.0, np.float32),
        unknown=np.zeros((8, 2), np.float32),
        ooi=np.zeros((8, 2), np.float32),
        levels=np.zeros((8, 4), np.int32),
    )
    nothing = np.zeros(8, np.float32)
    probabilities = np.array([0.02, 0.1, 0.25, 0.6], np.float32)
    choice = choose_view(sums, probabilities, 10, nothing, nothing > 0.0, weights, painted)
    assert choice.gain == pytest.approx(0.1)
    assert choice.potential == pytest.approx(2.0)


def test_a_viewpoint_turns_to_what_is_painted_and_its_gain_is_that_of_there():
    gains = np.array([3.0, 5.0, 2.0], np.float32)
    sums = ViewSums(
        known=np.stack([gains, gains - 1.0], axis=1),
        unknown=np.zeros((3, 2), np.float32),
        ooi=np.zeros((3, 2), np.float32),
        levels=np.zeros((3, 4), np.int32),
    )
    there = _choose(sums, weights=np.array([1.0, 1.0, 6.0], np.float32))
    assert (there.heading, there.gain, there.tilt, there.potential) == (2, 12.0, 0, 12.0)
    assert there.by_heading.tolist() == [3.0, 5.0, 12.0]


def test_a_painted_heading_counts_by_its_own_level_and_what_images_show_there():
    near = np.zeros((2, 4), np.int32)
    near[0, 3] = 50
    sums = ViewSums(
        known=np.array([[0.0, 0.0], [30.0, 0.0]], np.float32),
        unknown=np.array([[100.0, 0.0], [0.0, 100.0]], np.float32),
        ooi=np.zeros((2, 2), np.float32),
        levels=near,
    )
    weights = np.array([0.02, 1.0], np.float32)
    # Near something certain, but not wanted: the other heading is no likelier by that.
    there = _choose(sums, weights=weights)
    assert (there.heading, there.tilt, there.level) == (1, 0, 1)
    assert there.gain == pytest.approx(30.0)
    far_evidence_nat = np.array([0.0, 3.0], np.float32)
    there = _choose(sums, weights=weights, far_evidence_nat=far_evidence_nat)
    assert (there.heading, there.tilt) == (1, 1), "turned to where images showed it"
    assert there.gain > 60.0


def _choose(
    sums: ViewSums,
    *,
    weights: NDArray[np.float32],
    far_evidence_nat: NDArray[np.float32] | None = None,
) -> ViewChoice:
    probabilities = np.array([0.02, 0.1, 0.25, 0.6], np.float32)
    nothing = np.zeros(len(weights), np.float32)
    said = nothing if far_evidence_nat is None else far_evidence_nat
    return choose_view(sums, probabilities, 10, said, nothing > 0.0, weights, weights)
