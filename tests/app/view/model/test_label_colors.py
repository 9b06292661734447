import itertools

import numpy as np
import pytest

from app.view.colors import UNMAPPED
from app.view.model.label_colors import KIND_COLORS, OTHER, STRUCTURE_COLORS, LabelColors, with_rest
from app.view.words import ENGLISH

# Machado, Oliveira, Fernandes 2009, severity 1, on linear light.
SIGHT = {
    "normal": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
         [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
         [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602],
         [0.004733, 0.691367, 0.303900]]
    ),
}  # fmt: skip
TO_XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750],
     [0.0193339, 0.1191920, 0.9503041]]
)  # fmt: skip


def _lab(rgb, sight):
    """CIELAB of sRGB as seen with one kind of sight."""
    c = np.array(rgb) / 255.0
    linear = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    seen = np.clip(linear @ SIGHT[sight].T, 0.0, 1.0)
    x, y, z = seen @ TO_XYZ.T / np.array([0.95047, 1.0, 1.08883])
    f = [np.cbrt(t) if t > (6 / 29) ** 3 else t / (3 * (6 / 29) ** 2) + 4 / 29 for t in (x, y, z)]
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("sight", SIGHT)
def test_any_two_of_the_twelve_colours_stay_apart(sight):
    seen = [_lab(color, sight) for color in KIND_COLORS]
    assert len(seen) == 12
    least = min(float(np.linalg.norm(a - b)) for a, b in itertools.combinations(seen, 2))
    assert least > 25.0, "2.3 is just noticeable"


@pytest.mark.parametrize("sight", SIGHT)
def test_they_stay_apart_from_what_is_not_classified(sight):
    grey = _lab(UNMAPPED, sight)
    assert min(np.linalg.norm(_lab(color, sight) - grey) for color in KIND_COLORS) > 12.0


def test_the_check_would_notice_colours_that_a_colour_blind_eye_confuses():
    red, green = (200, 60, 40), (120, 110, 30)
    apart = {sight: np.linalg.norm(_lab(red, sight) - _lab(green, sight)) for sight in SIGHT}
    assert apart["deuteranopia"] < 25.0 < apart["normal"]


def _counts(**counts):
    out = np.zeros(256, np.int64)
    for name, count in counts.items():
        out[LABELS.index(name)] = count
    return out


LABELS = ["wall", "sofa", "tv_stand", *(f"thing_{n}" for n in range(20))]


def test_the_most_frequent_kinds_have_the_first_colours():
    colors = LabelColors()
    assert colors.update(LABELS, _counts(wall=900, sofa=50, tv_stand=80, thing_3=5))
    assert [entry.text for entry in with_rest(colors.entries, ENGLISH)] == [
        "tv stand", "sofa", "wall and floor", "not classified",
    ]  # fmt: skip
    assert tuple(colors.table[LABELS.index("tv_stand")]) == KIND_COLORS[0]
    assert tuple(colors.table[0]) == STRUCTURE_COLORS["wall"]
    assert tuple(colors.table[LABELS.index("thing_3")]) == OTHER, "too few voxels"
    assert tuple(colors.table[255]) == UNMAPPED


def test_a_kind_keeps_its_colour_when_others_become_more_frequent():
    colors = LabelColors()
    colors.update(LABELS, _counts(sofa=50))
    table = colors.table
    assert not colors.update(LABELS, _counts(sofa=51))
    assert colors.table is table, "nothing is drawn anew"
    assert colors.update([*LABELS, "hat"], _counts(sofa=60, thing_1=900))
    assert tuple(colors.table[LABELS.index("sofa")]) == KIND_COLORS[0]
    assert tuple(colors.table[LABELS.index("thing_1")]) == KIND_COLORS[1]


def test_the_thirteenth_kind_has_no_colour_of_its_own():
    colors = LabelColors()
    colors.update(LABELS, _counts(**{f"thing_{n}": 100 - n for n in range(13)}))
    assert tuple(colors.table[LABELS.index("thing_12")]) == OTHER
    assert "other kinds: click one for its name" in [
        entry.text for entry in with_rest(colors.entries, ENGLISH)
    ]


def test_another_vocabulary_begins_anew():
    colors = LabelColors()
    colors.update(LABELS, _counts(sofa=50))
    colors.update(["cup", "hat"], np.array([20, 0] + [0] * 254))
    assert colors.entries[0].text == "cup"
