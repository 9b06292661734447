"""Evidence is what the map makes of the same images."""

from dataclasses import replace

import numpy as np
import pytest

from ippon.calibration import evidence as evidence_module
from ippon.calibration.evidence import EvidenceCollector
from ippon.calibration.fit import score_of
from ippon.calibration.known_objects import KnownObject, KnownObjects
from ippon.mapping.config import MapConfig
from ippon.mapping.voxel_map import VoxelMap
from ippon.observation_model import shipped_models

TABLE = next(one.table for one in shipped_models() if one.kind == "scores")
CUP = KnownObject(label="cup", centre_world=(2.0, 0.0, 1.2), about_m=0.4)


def collected(images, known, labels=("cup",)):
    collector = EvidenceCollector(labels, 0.1, 4.0)
    for frame, heatmap in images:
        collector.add(frame, heatmap)
    return collector.evidence(known, np.eye(4))


def test_the_posterior_is_that_of_the_map(wall):
    images = [
        wall(value, y=y, n=n)
        for n, (value, y) in enumerate([(90, 0.0), (0, 0.0), (100, 0.0), (1, 1.0), (80, 1.0)])
    ]
    voxel_map = VoxelMap(MapConfig(memory_limit_mb=64.0), ("wall", "floor", "table"))
    for n in range(3):
        voxel_map.integrate(replace(images[0][0], stamp_ns=-(10**8) * (3 - n)))
    voxel_map.set_ooi("cup")
    for frame, heatmap in images:
        voxel_map.integrate(replace(frame, heatmap=heatmap))
    (evidence,) = collected(images, KnownObjects(objects=(), complete_for=frozenset({"cup"})))
    ratio = np.add.reduceat(
        np.log(evidence.values @ np.exp(TABLE.log_ratios("scores"))), evidence.first
    )
    odds = np.exp(ratio - np.log(3.0))
    assert voxel_map.best_ooi() == pytest.approx((odds / (1.0 + odds)).max(), abs=0.02)


def test_a_place_that_was_left_is_not_read_again(wall):
    known = KnownObjects(objects=(), complete_for=frozenset({"cup"}))
    there = [wall(100, n=0), wall(100, y=1.5, n=1)]
    (once,) = collected(there, known)
    (twice,) = collected([*there, wall(250, n=2)], known)
    middle = once.values[once.first].sum(axis=0), twice.values[twice.first].sum(axis=0)
    # Where the second image looked elsewhere, the third one continues the first one's place.
    assert middle[0].argmax() == middle[1].argmax() == 100
    assert np.allclose(twice.values.sum(axis=1), 1.0, atol=1e-5)


def test_an_object_its_surroundings_and_the_rest(wall):
    images = [wall(100), wall(100, n=1)]
    (evidence,) = collected(images, KnownObjects(objects=(CUP,)))
    assert set(evidence.of_object) == {0}
    (complete,) = collected(images, KnownObjects(objects=(CUP,), complete_for=frozenset({"cup"})))
    assert set(complete.of_object) == {0, -1}
    assert np.count_nonzero(complete.of_object == 0) == len(evidence.of_object)
    everything = KnownObjects(objects=(), complete_for=frozenset({"cup"}))
    (all_of_it,) = collected(images, everything)
    assert len(all_of_it.of_object) > len(complete.of_object), (
        "the edge of the cup counts neither way"
    )
    unclear = KnownObjects(objects=(), complete_for=frozenset({"cup"}), unclear=(CUP,))
    (without,) = collected(images, unclear)
    assert len(without.of_object) < len(all_of_it.of_object)


def test_images_are_grouped_once_for_all_questions(wall, monkeypatch):
    calls, grouped = [], evidence_module._grouped
    monkeypatch.setattr(
        evidence_module, "_grouped", lambda *given: calls.append(1) or grouped(*given)
    )
    known = KnownObjects(objects=(CUP,))
    collector = EvidenceCollector(["cup"], 0.1, 4.0)
    for n in range(2):
        collector.add(*wall(100, n=n))
    first, again = (collector.evidence(known, np.eye(4))[0] for _ in range(2))
    assert len(calls) == 1
    assert (first.values != again.values).nnz == 0
    (half,) = collector.evidence(known, np.eye(4), slice(1))
    assert (len(calls), half.images.max()) == (2, 1)
    collector.add(*wall(100, n=2))
    (more,) = collector.evidence(known, np.eye(4))
    assert more.images.max() == 3


def test_an_object_that_is_listed_twice_is_one(wall):
    away = replace(CUP, centre_world=(2.0, 9.0, 1.2))
    (evidence,) = collected([wall(100)], KnownObjects(objects=(away, CUP, CUP)))
    assert evidence.objects == 1
    assert set(evidence.of_object) == {0}
    assert score_of([evidence], TABLE, -3.7).objects == 1


@pytest.mark.parametrize("size_m", [0.0, -0.1, np.nan, np.inf])
def test_voxels_without_a_size_are_refused(size_m):
    with pytest.raises(ValueError, match="voxel_size_m must be positive; got"):
        EvidenceCollector(["cup"], size_m, 4.0)


def test_labels_that_were_not_searched_for_have_no_evidence(wall):
    known = KnownObjects(objects=(), absent=frozenset({"sofa"}))
    (evidence,) = collected([wall(100)], known, labels=("sofa",))
    assert evidence.values[:, 1].sum() == pytest.approx(evidence.values.shape[0])
    assert collected([], known) == []
