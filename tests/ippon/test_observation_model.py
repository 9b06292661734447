import json

import numpy as np
import pytest

from ippon.observation import Heatmap
from ippon.observation_model import (
    NOT_RECOGNISED,
    NOTHING_SAID,
    ObservationModel,
    ObservationModelError,
    ObservationModels,
    ScoreTable,
    read_observation_model,
    shipped_models,
)


def heatmap(kind="scores", source="x"):
    return Heatmap(
        labels=("cup",), ooi=None, probabilities=np.zeros((1, 1, 1), np.uint8), kind=kind,
        source=source,
    )  # fmt: skip


def test_shipped_models_never_fall_with_the_score_and_say_where_they_come_from():
    assert {model.source for model in shipped_models()} >= {"any scores", "any distribution"}
    for model in shipped_models():
        nats = model.table.log_ratios(model.kind)
        assert (np.diff(nats[2:]) >= 0.0).all()
        assert len(model.provenance) > 40


def test_the_default_of_distributions_is_the_papers_rule():
    nats = ObservationModels().of(heatmap("distribution")).table.log_ratios("distribution")
    expected = np.log(np.maximum(np.arange(256), 1) / 255.0)
    assert nats == pytest.approx(expected, abs=1e-5)


def test_labels_without_a_score_carry_no_evidence_and_unrecognised_ones_count_against():
    nats = ObservationModels().of(heatmap()).table.log_ratios("scores")
    assert nats[NOTHING_SAID] == 0.0
    assert nats[NOT_RECOGNISED] < 0.0


def test_a_model_of_the_source_comes_before_the_default():
    table = ScoreTable(scores=(0.0, 1.0), nats=(-1.0, 2.0))
    own = ObservationModel(source="x", kind="scores", table=table, provenance="test")
    assert ObservationModels([own]).of(heatmap()) is own
    assert ObservationModels([own]).of(heatmap("distribution")).source == "any distribution"


def test_a_model_is_read_as_it_was_written(tmp_path):
    table = ScoreTable(scores=(0.0, 1.0), nats=(-1.0, 2.0), not_recognised=-0.5)
    own = ObservationModel(
        source="x", kind="scores", table=table, labels={"cup": table}, provenance="test"
    )
    (tmp_path / "model.json").write_text(json.dumps(own.as_dict()))
    assert read_observation_model(tmp_path / "model.json") == own


@pytest.mark.parametrize(
    ("content", "text"),
    [
        ("{", "cannot read"),
        ("{}", "'source' is missing|'kind' is missing"),
        ('{"source": "x", "kind": "odd", "provenance": "p", "table": {}}', "got 'odd'"),
        (
            (
                '{"source": "x", "kind": "scores", "provenance": "p",'
                ' "table": {"scores": [0, 1], "nats": [1, 0]}}'
            ),
            "nats never fall",
        ),
        (
            (
                '{"source": "x", "kind": "scores", "provenance": "p",'
                ' "table": {"scores": [1, 0], "nats": [0, 1]}}'
            ),
            "scores rise",
        ),
    ],
)
def test_an_invalid_model_file_is_rejected_with_a_reason(tmp_path, content, text):
    (tmp_path / "model.json").write_text(content)
    with pytest.raises(ObservationModelError, match=text):
        read_observation_model(tmp_path / "model.json")
