import numpy as np
import pytest

from ippon.mission.finds.attributes.colour_regions import colour_name, lab_of, region_of
from ippon.simulation.homes.config import MUG_COLORS


def _lab(*rgb):
    return lab_of(np.array([rgb], np.uint8))


def test_lab_of_white_black_and_red():
    assert _lab(255, 255, 255)[0] == pytest.approx([100.0, 0.0, 0.0], abs=0.1)
    assert _lab(0, 0, 0)[0] == pytest.approx([0.0, 0.0, 0.0], abs=0.1)
    assert _lab(255, 0, 0)[0] == pytest.approx([53.2, 80.1, 67.2], abs=0.2)


@pytest.mark.parametrize("name", MUG_COLORS)
@pytest.mark.parametrize("light", [0.7, 1.0])
def test_a_colour_lies_in_its_region_in_shade_too_and_in_no_opposite_one(name, light):
    lab = lab_of((np.array([MUG_COLORS[name]]) * light).astype(np.uint8))
    region = region_of(name)
    assert region is not None
    assert region.contains(lab).all()
    others = {"red", "green", "blue", "yellow", "white", "black"} - {name}
    assert not any(region_of(other).contains(lab).any() for other in others)


@pytest.mark.parametrize(
    ("said", "rgb", "inside"),
    [
        ("dark blue", (20, 30, 80), True),
        ("dark blue", (150, 180, 240), False),
        ("light blue", (150, 180, 240), True),
        ("light blue", (20, 30, 80), False),
        ("navy", (20, 30, 80), True),
        ("brown", (120, 78, 44), True),
        ("beige", (222, 205, 172), True),
        ("pink", (236, 150, 180), True),
        ("purple", (110, 50, 140), True),
        ("orange", (240, 130, 30), True),
        ("grey", (128, 128, 130), True),
        ("grey", (200, 40, 40), False),
    ],
)
def test_shades_and_other_names(said, rgb, inside):
    assert region_of(said).contains(_lab(*rgb))[0] == inside


def test_what_no_region_is_known_of():
    assert region_of("colourful") is None
    assert region_of("") is None


def test_the_name_of_most_pixels():
    red, white = MUG_COLORS["red"], MUG_COLORS["white"]
    pixels = np.array([red] * 7 + [white] * 3, np.uint8)
    assert colour_name(lab_of(pixels)) == "red"
    motley = np.array([red, white, MUG_COLORS["blue"], MUG_COLORS["green"]], np.uint8)
    assert colour_name(lab_of(motley)) == ""
    assert colour_name(np.zeros((0, 3))) == ""
