import numpy as np
import pytest

from app.view.colormaps import CIVIDIS, INFERNO
from app.view.colors import (
    COLOR_MODES,
    LEVEL_COLORS,
    MINIMAL,
    NOT_MAPPED,
    TERMINATING,
    UNMAPPED,
    hex_of,
    legend,
    linear,
    node_colors,
    voxel_colors,
)
from app.view.words import ENGLISH
from ippon.guidance.levels import Level
from ippon.planning.plan import NodeKind


def _voxels(n=5, **changes):
    arrays = {
        "rgb": np.arange(3 * n, dtype=np.uint8).reshape(n, 3),
        "ooi": np.full(n, 100, np.uint8),
        "level": np.full(n, Level.NEAR, np.uint8),
        "height_m": np.linspace(0.0, 2.0, n, dtype=np.float32),
        "top_m": 2.0,
        "thing": np.full(n, 50, np.uint8),
        "gain": np.full(n, 200, np.uint8),
    }
    return arrays | changes


@pytest.mark.parametrize("table", [INFERNO, CIVIDIS])
def test_tables_grow_lighter(table):
    luminance = table @ np.array([0.2126, 0.7152, 0.0722])
    assert table.shape == (256, 3)
    assert (np.diff(luminance) > -2.0).all()
    assert luminance[-1] > luminance[0] + 100.0


@pytest.mark.parametrize("mode", COLOR_MODES)
def test_every_mode_gives_a_colour_to_every_voxel(mode):
    colors = voxel_colors(mode, **_voxels())
    assert colors.shape == (5, 3)
    assert colors.dtype == np.uint8


def test_camera_mode_shows_what_the_camera_saw():
    voxels = _voxels()
    assert (voxel_colors("camera", **voxels) == voxels["rgb"]).all()


def test_proximity_mode_uses_the_palette_of_the_levels():
    level = np.array([*sorted(Level), NOT_MAPPED], np.uint8)
    colors = voxel_colors("proximity", **_voxels(5, level=level))
    assert [tuple(c) for c in colors.tolist()] == [
        *(LEVEL_COLORS[one] for one in sorted(Level)),
        UNMAPPED,
    ]


def test_a_likelier_voxel_is_lighter_and_an_unknown_one_grey():
    ooi = np.array([0, 120, 254, NOT_MAPPED], np.uint8)
    colors = voxel_colors("ooi", **_voxels(4, ooi=ooi)).astype(int)
    assert (np.diff(colors[:3].sum(axis=1)) > 0).all()
    assert tuple(colors[3]) == UNMAPPED


def test_heights_beyond_the_ramp_keep_its_ends():
    height = np.array([-5.0, 50.0], np.float32)
    colors = voxel_colors("height", **_voxels(2, height_m=height))
    assert (colors == CIVIDIS[[0, 255]]).all()


def test_nodes_are_coloured_as_in_the_paper():
    kinds = np.array([NodeKind.EXPLORING, NodeKind.EXPLORING, NodeKind.MINIMAL, 2], np.uint8)
    low, high, minimal, terminating = node_colors(kinds, np.array([1, 9, 0, 5], np.float32))
    assert low[2] > low[0]
    assert high[0] > high[2]
    assert tuple(minimal) == MINIMAL
    assert tuple(terminating) == TERMINATING


def test_equal_gains_do_not_divide_by_zero():
    colors = node_colors(np.zeros(3, np.uint8), np.full(3, 4.0, np.float32))
    assert (colors == colors[0]).all()


def test_linear_light_keeps_the_ends_and_the_order():
    table = linear(np.arange(256, dtype=np.uint8)).astype(int)
    assert (table[0], table[255]) == (0, 255)
    assert (np.diff(table) >= 0).all()
    assert table[128] == 55


def test_legends_say_what_the_colours_mean():
    assert [entry.text for entry in legend("proximity", 2.0, ENGLISH).entries][:4] == [
        "certain",
        "near",
        "average",
        "far",
    ]
    assert legend("height", 1.6, ENGLISH).high == "1.6 m"
    assert legend("ooi", 1.6, ENGLISH).ramp is not None
    assert hex_of((213, 94, 0)) == "#d55e00"


def test_things_have_the_colours_of_their_kinds_unless_one_is_chosen():
    kind = np.tile(np.array([1, 2, 3], np.uint8), (5, 1))
    assert (voxel_colors("thing", **_voxels(kind=kind)) == kind).all()
    chosen = voxel_colors("thing", **_voxels())
    assert (chosen == voxel_colors("ooi", **_voxels(ooi=np.full(5, 50, np.uint8)))).all()
    entries = legend("thing", 2.0, ENGLISH, ()).entries
    assert entries == ()
    assert legend("thing", 2.0, ENGLISH).ramp is not None
