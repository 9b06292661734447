"""Sizes and shapes of single pieces: believable, and as their frame says."""

import numpy as np
import pytest

from ippon.simulation.homes.furniture import bathroom as bathing
from ippon.simulation.homes.furniture import beds as sleeping
from ippon.simulation.homes.furniture import decor, kitchen, leisure, seating, storage, tables
from ippon.simulation.homes.furniture.small_objects import SMALL_THINGS, small_thing
from ippon.simulation.homes.furniture.style import make_style
from ippon.vocabulary import MATTERPORT_40

# Name -> maker, greatest width, depth and height in metres, least height.
FURNITURE = {
    "chair": (seating.chair, 0.55, 0.55, 1.1, 0.75),
    "office chair": (seating.office_chair, 0.7, 0.7, 1.2, 0.9),
    "armchair": (seating.armchair, 1.0, 1.0, 1.1, 0.7),
    "sofa": (lambda r, s: seating.sofa(r, s, 2.0), 2.1, 1.05, 1.0, 0.65),
    "corner sofa": (lambda r, s: seating.corner_sofa(r, s, 2.2), 2.3, 1.8, 1.0, 0.65),
    "stool": (seating.stool, 0.5, 0.5, 0.55, 0.4),
    "bed": (lambda r, s: sleeping.bed(r, s, 1.6), 1.8, 2.4, 1.3, 0.7),
    "bunk bed": (sleeping.bunk_bed, 1.1, 2.2, 1.8, 1.4),
    "nightstand": (sleeping.nightstand, 0.6, 0.5, 0.65, 0.35),
    "dining table": (lambda r, s: tables.dining_table(r, s, 1.6, 0.9), 1.65, 0.95, 0.8, 0.7),
    "round table": (lambda r, s: tables.round_table(r, s, 0.5), 1.05, 1.05, 0.8, 0.7),
    "coffee table": (tables.coffee_table, 1.25, 1.0, 0.5, 0.3),
    "desk": (tables.desk, 1.6, 0.8, 0.8, 0.7),
    "wardrobe": (lambda r, s: storage.wardrobe(r, s, 1.5), 1.55, 0.7, 2.4, 1.9),
    "chest": (storage.chest_of_drawers, 1.4, 0.6, 1.1, 0.7),
    "bookshelf": (lambda r, s: storage.bookshelf(r, s, 1.0), 1.05, 0.4, 2.2, 1.4),
    "fridge": (lambda r, _: kitchen.fridge(r), 0.75, 0.8, 2.05, 1.6),
    "counter": (lambda r, s: kitchen.counter(r, s, 2.0), 2.05, 0.7, 0.95, 0.85),
    "washing machine": (lambda r, _: kitchen.washing_machine(r), 0.65, 0.65, 0.9, 0.8),
    "toilet": (lambda r, _: bathing.toilet(r), 0.55, 0.75, 1.1, 0.7),
    "bathtub": (lambda r, _: bathing.bathtub(r), 1.8, 0.85, 0.75, 0.5),
    "shower": (lambda r, _: bathing.shower(r, glass_left=True), 1.2, 1.0, 2.1, 1.9),
    "washbasin": (bathing.washbasin, 1.0, 0.55, 1.05, 0.85),
    "plant": (lambda r, _: decor.plant(r, height=1.2), 1.3, 1.3, 1.5, 0.7),
    "floor lamp": (decor.floor_lamp, 0.5, 0.5, 1.8, 1.3),
    "tv": (lambda r, _: decor.television(r, 1.2, on_stand=True), 1.1, 0.3, 0.75, 0.55),
    "fireplace": (lambda r, _: decor.fireplace(r), 1.7, 0.5, 1.1, 1.0),
    "bike": (lambda r, _: leisure.exercise_bike(r), 0.6, 1.1, 1.2, 0.9),
    "piano": (lambda r, _: leisure.piano(r), 1.6, 0.7, 1.3, 1.1),
}


@pytest.mark.parametrize("name", FURNITURE)
@pytest.mark.parametrize("seed", range(4))
def test_furniture_has_the_size_of_furniture(name, seed):
    make, width, depth, high, low = FURNITURE[name]
    rng = np.random.default_rng(seed)
    model = make(rng, make_style(rng))
    assert model.category in MATTERPORT_40
    assert model.label == model.label.lower().strip()
    assert model.width_m <= width
    assert model.depth_m <= depth
    assert low <= model.height_m <= high
    assert 20 <= len(model.mesh.faces) <= 900
    assert np.isfinite(model.mesh.vertices).all()
    assert len(np.unique(model.mesh.colors, axis=0)) >= 2
    assert model.mesh.vertices[:, 2].min() == pytest.approx(0.0, abs=0.23)


@pytest.mark.parametrize("name", [n for n in FURNITURE if n not in ("plant", "corner sofa")])
def test_backs_stand_at_zero_and_middles_at_zero(name):
    make = FURNITURE[name][0]
    rng = np.random.default_rng(1)
    vertices = make(rng, make_style(rng)).mesh.vertices
    assert vertices[:, 1].min() >= -0.06
    assert vertices[:, 0].min() == pytest.approx(-vertices[:, 0].max(), abs=0.08)


@pytest.mark.parametrize("name", FURNITURE)
def test_things_can_lie_on_the_surfaces_that_a_piece_names(name):
    make = FURNITURE[name][0]
    rng = np.random.default_rng(2)
    model = make(rng, make_style(rng))
    for s in model.surfaces:
        assert s.x0 < s.x1
        assert s.y0 < s.y1
        heights = model.mesh.vertices[:, 2]
        assert np.abs(heights - s.z).min() < 0.03
        assert s.headroom_m > 0.0


@pytest.mark.parametrize("label", SMALL_THINGS)
@pytest.mark.parametrize("seed", range(3))
def test_small_objects_are_small_and_stand_at_z_0(label, seed):
    model = small_thing(np.random.default_rng(seed), label)
    low, high = model.mesh.vertices.min(axis=0), model.mesh.vertices.max(axis=0)
    assert model.label == label
    assert model.category in ("objects", "clothes")
    assert -0.03 <= low[2] <= 0.02
    assert (high - low).max() < 1.2
    assert (high - low).max() > 0.05
    assert (high - low).min() > 0.005
    assert 12 <= len(model.mesh.faces) <= 500


def test_an_unknown_small_object_is_rejected():
    with pytest.raises(
        ValueError, match="no small object is called 'unicorn'; there are mug, book"
    ):
        small_thing(np.random.default_rng(0), "unicorn")
