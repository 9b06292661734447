import copy
from xml.etree import ElementTree as ET

from app.messages.driving import PaintedRegions, PaintedStroke
from app.view.model.scene_model import SceneModel
from app.view.plan.plan_drawing import plan_svg
from app.view.words import ENGLISH, Words

SVG = "{http://www.w3.org/2000/svg}"


def test_names_are_texts_and_their_markup_is_not(flat):
    root = ET.fromstring(plan_svg(flat, ENGLISH))
    texts = [element.text for element in root.iter(f"{SVG}text")]
    assert "<b>Anna's</b> & co" in texts
    assert "sofa" in texts
    assert texts[-1] == "1 m"
    german = ET.fromstring(plan_svg(flat, Words("de")))
    texts = [element.text for element in german.iter(f"{SVG}text")]
    assert "<b>Anna's</b> & co" in texts
    assert "Sofa" in texts


def test_each_kind_of_cell_is_one_shape(flat):
    root = ET.fromstring(plan_svg(flat, ENGLISH))
    shapes = {element.get("id") for element in root.iter(f"{SVG}path")}
    assert {"floor", "furniture", "wall"} <= shapes


def test_a_painted_region_is_one_area_of_one_tone(flat):
    model, strokes = copy.copy(flat), [(1.0, 1.0), (1.5, 1.0)]
    region = PaintedStroke(kind="not_here", strokes=strokes, radius_m=0.6)
    model.on_painted(PaintedRegions(regions=[region]))
    root = ET.fromstring(plan_svg(model, ENGLISH))
    (area,) = (group for group in root.iter(f"{SVG}g") if group.get("opacity"))
    assert [disc.tag for disc in area] == [f"{SVG}circle"] * 2
    assert not any(disc.get("fill-opacity") for disc in area)


def test_without_a_map_there_is_no_drawing():
    assert plan_svg(SceneModel(), ENGLISH) is None
