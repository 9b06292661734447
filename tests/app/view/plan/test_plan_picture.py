import copy
import io

import numpy as np
from PIL import Image

from app.messages.driving import PaintedRegions, PaintedStroke
from app.view.model.scene_model import SceneModel
from app.view.plan.plan_cells import Cell
from app.view.plan.plan_picture import PIXELS, _font, plan_png
from app.view.plan.plan_scene import cells_of
from app.view.plan.sheet import CELL_COLORS, Sheet
from app.view.words import ENGLISH


def test_cells_have_their_colours_where_they_are(flat):
    image = np.asarray(Image.open(io.BytesIO(plan_png(flat, ENGLISH))))
    sheet = Sheet(cells_of(flat))
    scale = PIXELS / sheet.width_m

    def at(x, y):
        u, v = sheet.place(x, y)
        return tuple(image[int(v * scale), int(u * scale)].tolist())

    assert at(1.0, 1.0) == CELL_COLORS[Cell.FLOOR]
    assert at(5.9, 5.5) == CELL_COLORS[Cell.FURNITURE]
    assert at(4.05, 1.0) == CELL_COLORS[Cell.WALL]
    assert at(-0.5, -0.5) == CELL_COLORS[Cell.UNKNOWN]
    assert max(image.shape[:2]) == PIXELS


def test_discs_of_a_painted_region_that_overlap_have_one_tone(flat):
    model, strokes = copy.copy(flat), [(1.0, 1.0), (1.5, 1.0)]
    region = PaintedStroke(kind="not_here", strokes=strokes, radius_m=0.6)
    model.on_painted(PaintedRegions(regions=[region]))
    image = np.asarray(Image.open(io.BytesIO(plan_png(model, ENGLISH))))
    sheet = Sheet(cells_of(flat))
    scale = PIXELS / sheet.width_m

    def at(x, y):
        u, v = sheet.place(x, y)
        return tuple(image[int(v * scale), int(u * scale)].tolist())

    assert at(0.7, 1.0) == at(1.25, 1.0) != CELL_COLORS[Cell.FLOOR]


def test_the_font_has_the_letters_of_european_languages():
    font = _font(40.0)
    box = bytes(font.getmask("\ue000"))
    for letter in "äöüÄÖÜßéłñçøåőřșğΩжЯ²’–":
        assert bytes(font.getmask(letter)) != box, letter
    assert font.getname()[0] == "Roboto"


def test_without_a_map_there_is_no_picture():
    assert plan_png(SceneModel(), ENGLISH) is None
