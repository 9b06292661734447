"""Files for pages, written in the thread of the scene."""

import asyncio
import json

import msgspec
import numpy as np
import pytest

from app.nodes.console.scene.export_requests import ExportRequests
from app.view.exports import FILES
from app.view.words import ENGLISH
from tests.app.nodes.console.drawn_home import cloud_of
from tests.app.view.plan.conftest import flat_on


@pytest.fixture
def cells_written(monkeypatch):
    """Counts how often the cells of the plan are written."""
    kind, write = FILES["plan-cells.json"]
    calls = []
    counted = lambda model, say: calls.append(model) or write(model, say)  # noqa: E731
    monkeypatch.setitem(FILES, "plan-cells.json", (kind, counted))
    return calls


def _ordered(requests, model):
    async def order():
        answer = asyncio.ensure_future(requests.order("plan-cells.json"))
        await asyncio.sleep(0)
        requests.fill(model, ENGLISH)
        return await answer

    return json.loads(asyncio.run(order()))


def test_cells_of_the_plan_are_written_once_for_all_who_ask(cells_written):
    requests, model = ExportRequests(), flat_on(0)
    first = _ordered(requests, model)
    assert _ordered(requests, model) == first
    assert len(cells_written) == 1
    model.on_voxels(cloud_of(np.array([[2, 2, 9]]), np.array([0]), 2))
    assert _ordered(requests, model)["revision"] > first["revision"]
    assert len(cells_written) == 2
    # Another label is the wall.
    table = msgspec.structs.replace(model.proximity, rows=model.proximity.rows[::-1])
    model.on_proximity(table)
    _ordered(requests, model)
    assert len(cells_written) == 3
