"""Observation models as the kernels read them."""

import dataclasses

import numpy as np
import pytest

from ippon.mapping.objects.likelihood_tables import LikelihoodTables
from ippon.observation import Heatmap
from ippon.observation_model import ObservationModel, ObservationModels, ScoreTable

COMMON = ScoreTable(scores=(0.0, 1.0), nats=(-1.0, 2.0))
CUP = ScoreTable(scores=(0.0, 1.0), nats=(-3.0, 4.0))
HAT = ScoreTable(scores=(0.0, 1.0), nats=(-5.0, 6.0))
MODEL = ObservationModel(
    source="x", kind="scores", table=COMMON, labels={"cup": CUP, "hat": HAT}, provenance="test"
)
HEATMAP = Heatmap(
    labels=("bed", "cup"),
    ooi="hat",
    probabilities=np.zeros((1, 1, 3), np.uint8),
    kind="scores",
    source="x",
)


@pytest.fixture
def tables() -> LikelihoodTables:
    return LikelihoodTables(ObservationModels([MODEL]))


def test_each_label_has_the_row_of_its_own_table_or_the_common_one(tables):
    ratios, rows = tables.of(HEATMAP, ("bed", "cup"), "hat")
    expected = [np.exp(table.log_ratios("scores")) for table in (COMMON, CUP, HAT)]
    np.testing.assert_array_equal(ratios[rows], expected)
    assert ratios.dtype == np.float32
    _, rows = tables.of(HEATMAP, ("cup", "bed"), "sofa")
    assert rows.tolist() == [1, 0, 0]


def test_without_an_object_of_interest_its_row_is_the_common_one(tables):
    _, rows = tables.of(HEATMAP, ("bed", "cup"), None)
    assert rows.tolist() == [0, 1, 0]


def test_without_a_heatmap_nothing_is_evidence(tables):
    ratios, rows = tables.of(None, ("bed", "cup"), "hat")
    assert ratios.shape == (1, 256)
    assert (ratios == 1.0).all()
    assert rows.tolist() == [0, 0, 0]


def test_tables_are_made_once_for_each_source_labels_and_object(tables):
    first = tables.of(HEATMAP, ("bed",), "hat")
    assert tables.of(HEATMAP, ("bed",), "hat") is first
    assert tables.of(HEATMAP, ("bed",), "cup") is not first
    other = dataclasses.replace(HEATMAP, source="another network")
    assert not np.array_equal(tables.of(other, ("bed",), "hat")[0], first[0])
