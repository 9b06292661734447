import numpy as np
import pytest

from ippon.simulation.segmentation.false_places import FalsePlaceConfig, draw_false_places

LABELS = ("plant", "chair", "cup")


def places_of(scene, labels=LABELS, seed=3, **changes):
    names = [i.category for i in scene.instances]
    is_label = np.array([[name == label for label in labels] for name in names])
    config = FalsePlaceConfig(**changes)
    return draw_false_places(scene, labels, is_label, config, seed)


def test_places_lie_on_the_surface_of_their_thing(furnished):
    places = places_of(furnished)
    low = np.array([i.aabb_min for i in furnished.instances])[places.instance]
    high = np.array([i.aabb_max for i in furnished.instances])[places.instance]
    assert len(places.points) > 100
    assert (places.points >= low - 1e-5).all()
    assert (places.points <= high + 1e-5).all()
    # Boxes have no inside: a point of their surface touches a side.
    touch = np.minimum(np.abs(places.points - low), np.abs(places.points - high)).min(axis=1)
    assert touch.max() < 1e-5


def test_where_a_label_is_right_it_has_no_place(furnished):
    places = places_of(furnished)
    of_chairs = [i.category == "chair" for i in furnished.instances]
    on_chair = np.array(of_chairs)[places.instance]
    assert on_chair.any()
    assert not (places.label[on_chair] == LABELS.index("chair")).any()


def test_density_is_as_configured(furnished):
    places = places_of(furnished, per_m2=20.0, per_m2_of_stuff=0.0, count_sigma=0.0)
    corners = furnished.vertices[furnished.faces].astype(float)
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = 0.5 * np.linalg.norm(cross, axis=1)
    table = next(k for k, i in enumerate(furnished.instances) if i.category == "table")
    expected = 20.0 * area[furnished.face_instance == table].sum() * len(LABELS)
    assert (places.instance == table).sum() == pytest.approx(expected, rel=0.15)
    stuff = {k for k, i in enumerate(furnished.instances) if i.category in {"wall", "floor"}}
    assert not stuff & set(places.instance.tolist())


def test_a_label_keeps_its_places_whatever_the_others_are(furnished):
    alone, among = places_of(furnished, ("cup",)), places_of(furnished)
    mine = among.label == LABELS.index("cup")
    np.testing.assert_array_equal(alone.points, among.points[mine])
    np.testing.assert_array_equal(alone.keys, among.keys[mine])
    other = places_of(furnished, ("cup",), seed=4)
    assert not np.array_equal(alone.points[:5], other.points[:5])


def test_sizes_are_a_share_of_those_of_the_labels_things(furnished):
    places = places_of(furnished, size_sigma=0.0)
    chair = places.size_m[places.label == LABELS.index("chair")]
    # 0.7 x 0.7 x 0.9 m: the two longer sides.
    np.testing.assert_allclose(chair, 0.6 * np.sqrt(0.7 * 0.9), rtol=1e-6)


def test_a_density_below_zero_is_refused():
    with pytest.raises(ValueError, match="densities and sigmas lie in 0 to 100"):
        FalsePlaceConfig(per_m2=-1.0)
