import json
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from ippon.observation import Heatmap
from ippon.observation_model import (
    LEAST_SCORE,
    MOST_NATS,
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
    table = ScoreTable(scores=(0.0, 1.0), nats=(-0.5, 2.0), not_recognised=-1.0)
    own = ObservationModel(
        source="x", kind="scores", table=table, labels={"cup": table}, provenance="test"
    )
    (tmp_path / "model.json").write_text(json.dumps(own.as_dict()))
    assert read_observation_model(tmp_path / "model.json") == own


ratios = st.floats(-12.0, 12.0)


@settings(max_examples=50)
@given(
    knots=st.lists(st.tuples(st.floats(0.0, 1.0), ratios), min_size=2, max_size=6),
    not_recognised=st.floats(-12.0, 0.0),
    kind=st.sampled_from(("scores", "distribution")),
)
def test_the_ratio_of_a_score_lies_between_those_of_its_knots(knots, not_recognised, kind):
    scores, nats = (np.sort(values) for values in zip(*knots, strict=True))
    assume((np.diff(scores) > 1e-6).all())
    table = ScoreTable(scores=tuple(scores), nats=tuple(nats), not_recognised=not_recognised)
    found = table.log_ratios(kind)
    first = 0 if kind == "distribution" else LEAST_SCORE
    assert (np.diff(found[first:]) >= 0.0).all()
    assert found[first:].min() >= nats[0] - 1e-5
    assert found[first:].max() <= nats[-1] + 1e-5
    for value in (LEAST_SCORE, 51, 254, 255):
        at_least = np.searchsorted(scores, value / 255.0, side="right") - 1
        assert found[value] >= nats[max(at_least, 0)] - 1e-5
        assert found[value] <= nats[min(at_least + 1, len(nats) - 1)] + 1e-5


def test_scores_between_knots_are_interpolated():
    table = ScoreTable(scores=(0.2, 0.6), nats=(-1.0, 3.0))
    assert table.not_recognised == 0.0
    scores = table.log_ratios("scores")
    assert [LEAST_SCORE, MOST_NATS] == [2, 12.0]
    assert scores[102] == pytest.approx(1.0), "0.4, halfway"
    assert scores[2] == -1.0
    assert scores[255] == 3.0


def test_probabilities_between_knots_are_interpolated_in_their_logarithm():
    found = ScoreTable(scores=(0.0, 1.0), nats=(-5.0, 0.0)).log_ratios("distribution")
    assert (found[0], found[1], found[255]) == (-5.0, -5.0, 0.0)
    # 0 stands for 1/255, the least probability of a heatmap.
    assert found[51] == pytest.approx(-5.0 * math.log(0.2) / math.log(1.0 / 255.0))


def test_the_labels_of_a_file_are_read_as_they_may_be_typed():
    """A table under another spelling would never be used."""
    table = {"scores": [0.3, 0.6], "nats": [-0.5, 6.0], "not_recognised": -0.5}
    content = {"source": "x", "kind": "scores", "provenance": "test", "table": table}
    named = content | {"labels": {"Dining Table": table | {"nats": [0.0, 9.0]}}}
    assert ObservationModel.parse(named).table_of("dining_table").nats == (0.0, 9.0)
    twice = content | {"labels": {"Dining Table": table, "dining_table": table}}
    with pytest.raises(ObservationModelError, match="two of the labels are the same: Dining Table"):
        ObservationModel.parse(twice)


@pytest.mark.parametrize(
    ("table", "text"),
    [
        ({"scores": (0.5,), "nats": (0.0,)}, "two at least; got 1 and 1"),
        ({"scores": (0.0, 1.0), "nats": (0.0, 1.0, 2.0)}, "two at least; got 2 and 3"),
        ({"scores": (0.0, 0.5, 0.5), "nats": (0.0, 1.0, 2.0)}, "scores rise"),
        ({"scores": (0.5, 0.0, 1.0), "nats": (0.0, 1.0, 2.0)}, "scores rise"),
        ({"scores": (-0.01, 1.0), "nats": (0.0, 1.0)}, "within 0 to 1"),
        ({"scores": (0.0, 0.5, 1.01), "nats": (0.0, 1.0, 2.0)}, "within 0 to 1"),
        ({"scores": (0.0, 0.5, 1.0), "nats": (0.0, 1.0, 0.5)}, "nats never fall"),
        ({"scores": (0.0, 1.0), "nats": (0.0, 12.1)}, "within ±12"),
        ({"scores": (0.0, 1.0), "nats": (-12.1, 0.0)}, "within ±12"),
        (
            {"scores": (0.0, 1.0), "nats": (0.0, 1.0), "not_recognised": 0.1},
            "0 or less, and at least -12; got 0.1",
        ),
        ({"scores": (0.0, 1.0), "nats": (0.0, 1.0), "not_recognised": -12.1}, "at least -12"),
    ],
)
def test_a_table_that_is_not_monotone_or_not_bounded_is_rejected(table, text):
    with pytest.raises(ValueError, match=text):
        ScoreTable(**table)


def test_the_bounds_of_a_table_belong_to_it():
    table = ScoreTable(scores=(0.0, 0.5, 1.0), nats=(-12.0, 12.0, 12.0), not_recognised=-12.0)
    assert table.log_ratios("scores")[[0, 2, 255]].tolist() == pytest.approx(
        [-12.0, -11.6, 12.0], abs=0.1
    )


def test_tables_of_earlier_fits_that_fall_at_the_bottom_are_raised_and_said(tmp_path):
    falling = {"scores": [0.2, 0.4, 0.6], "nats": [-3.0, -1.0, 5.0], "not_recognised": -0.5}
    rising = {"scores": [0.2, 0.6], "nats": [-0.5, 5.0], "not_recognised": -0.5}
    content = {"source": "net", "kind": "scores", "provenance": "an earlier fit"}
    path = tmp_path / "table.json"

    def read(**tables):
        path.write_text(json.dumps({**content, **tables}))
        return read_observation_model(path)

    model = read(table=rising, labels={"chair": falling, "cup": rising})
    assert model.table_of("chair").nats == (-0.5, -0.5, 5.0)
    assert model.table_of("cup").nats == model.table.nats == (-0.5, 5.0)
    assert model.note.startswith("table.json: a weak score of chair told more against an object")
    ratios = model.table_of("chair").log_ratios("scores")
    assert ratios[LEAST_SCORE:].min() == ratios[NOT_RECOGNISED]
    assert (
        "a weak score of chair, other labels told"
        in read(table=falling, labels={"chair": falling}).note
    )
    assert read(table=rising).note == ""
    del falling["not_recognised"]
    by_hand = read(table=falling)
    assert (by_hand.table.nats, by_hand.note) == ((-3.0, -1.0, 5.0), "")
    falling["not_recognised"] = -0.5
    content["kind"] = "distribution"
    assert read(table=falling).table.nats == (-3.0, -1.0, 5.0), "it has no such value"


def test_a_file_may_leave_out_what_was_not_recognised():
    content = {
        "source": "x",
        "kind": "scores",
        "provenance": "test",
        "table": {"scores": [0, 1], "nats": [0, 1]},
    }
    assert ObservationModel.parse(content).table.not_recognised == 0.0


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


def test_a_model_of_another_network_is_refused():
    table = ScoreTable(scores=(0.3, 0.6), nats=(0.0, 6.0))
    own = ObservationModel(source="yolo", kind="scores", table=table, provenance="x")
    own.check_network("yolo", "scores")
    ObservationModel(source="any scores", kind="scores", table=table, provenance="x").check_network(
        "nanodet", "scores"
    )
    for source, kind in (("nanodet", "scores"), ("yolo", "distribution")):
        with pytest.raises(ObservationModelError, match=f"of 'yolo' .* network is '{source}'"):
            own.check_network(source, kind)
