"""`ippon navigate --segmentation.where here`, from its options to labels in the map.

Everything is as it is in use but for two things: the network is tiny and random, and what is a
process of its own runs in a thread.
"""

import threading

import pytest
import tyro

from app.cli.nodes import navigate
from app.cli.nodes.segment import run_segment_command
from app.cli.options.nodes import Navigate, Segment
from app.cli.options.segmentation import NavigatorSegmentation
from app.messages import keys
from app.messages.control import SearchRequest, encode
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.node import Navigator
from ippon.mapping.objects.surface_voxels import N_USED, NO_LABEL
from tests import later
from tests.app.nodes.navigator.scenarios.standing_robot import Robot

later.needs("torch", "transformers", extra="segmentation")
save_clipseg = later.names("tests.ippon.segmentation.backends.tiny_models", "save_clipseg")

PATIENCE_S = 300.0


@pytest.fixture
def model(tmp_path):
    """A folder with a CLIPSeg that has learnt nothing."""
    save_clipseg(tmp_path)
    return tmp_path


@pytest.fixture
def in_a_thread(monkeypatch):
    """What takes the place of `Child`."""
    stop = threading.Event()
    monkeypatch.setattr("app.nodes.segment.ProcessStopSignal", lambda: stop)

    class InAThread:
        stopped = False

        def __init__(self, name, arguments):
            assert arguments[0] == name.removesuffix("ation"), "ippon segment"
            command = tyro.cli(Segment, args=arguments[1:])
            self._thread = threading.Thread(target=run_segment_command, args=(command,))
            self._thread.start()

        def wait(self):
            self._thread.join()
            return 0

        def stop(self):
            stop.set()
            self.wait()

    monkeypatch.setattr(navigate, "Child", InAThread)


@pytest.mark.usefixtures("in_a_thread")
@pytest.mark.slow
def test_segmentation_beside_the_navigator_teaches_the_map(sessions, free_endpoint, model):
    router, client = sessions
    navigator, stop = Navigator(NavigatorConfig(robot="r"), router), threading.Event()
    thread = threading.Thread(target=navigator.run, args=(stop,))
    thread.start()
    options = NavigatorSegmentation(
        where="here", backend="clipseg", model=str(model), device="cpu", longest_side_px=32
    )
    command = Navigate(listen=free_endpoint, robot="r", segmentation=options)
    segmentation = navigate._start_segmentation(command)
    try:
        request = encode(SearchRequest(object="hat"))
        list(client.get(f"r/{keys.SEARCH}", payload=request, timeout=PATIENCE_S))
        # No heatmap comes from the robot itself.
        Robot(client).send_until(lambda s: s.best_ooi > 0.0, PATIENCE_S, heatmap=False)
    finally:
        segmentation.stop()
        stop.set()
        thread.join()
        navigator.close()
    voxel_map = navigator._mission.voxel_map
    used = slice(1, int(voxel_map.surface.tally[N_USED]))
    assert (voxel_map.surface.label[used] != NO_LABEL).mean() > 0.3
    # A heatmap that came late has brought no depth along.
    assert voxel_map._pools.weight.max() <= navigator._intake.frames
