"""Faults in mid-search: the robot stands half a second after the last command, and goes on."""

import contextlib
import os
import random
import sys
import time

import msgspec
import pytest

from tests.app.faulty_search import FaultySearch, coasted_s, freeze, starve
from tests.app.lossy_relay import LossyRelay

pytestmark = [pytest.mark.process, pytest.mark.slow]

STAND_S = 0.5
BACK_S = 60.0
"""Twelve times what it takes on an idle machine."""
LATENCY_S = 0.3
LOSS = 0.1
CAMPAIGN_S = float(os.environ.get("IPPON_FAULTS_S", "600"))


@pytest.fixture
def line(free_endpoint):
    """The robot's link to the navigator."""
    relay = LossyRelay(int(free_endpoint.rsplit(":", 1)[1]), 0.0, 0.0)
    yield relay
    relay.close()


@pytest.fixture
def search(launch, free_endpoint, tmp_path, line):
    search = FaultySearch(launch, free_endpoint, tmp_path, f"tcp/127.0.0.1:{line.port}")
    search.start_navigator()
    search.search("hat")
    search.start_robot()
    search.wait_until_moving()
    yield search
    search.close()


@contextlib.contextmanager
def safely(search):
    """Whatever happens within: the robot coasts no longer than it may, and touches nothing."""
    # It touches things without any fault, too: where its camera does not look.
    before = search.truth().collisions
    yield
    truth = search.truth()
    assert truth.speeds
    assert coasted_s(truth) <= STAND_S
    assert truth.collisions == before, truth.trajectory[-1]


def test_a_killed_navigator_is_succeeded_by_one_that_goes_on_or_stays_stopped(search, tmp_path):
    # The map is written for the first time after five seconds.
    while not (tmp_path / "home.map").exists():
        time.sleep(0.1)
    before = search.wait_for(lambda s: s.surface_voxels > 500)
    search.wait_until_moving()
    with safely(search):
        search.navigator.child.kill()
        search.navigator.child.wait()
        began = search.start_navigator()
        assert search.wait_until_moving() - began < BACK_S
        after = search.wait_for(lambda s: s.frames > 3)
    assert after.goal is not None
    assert (after.goal.object, after.goal.outcome) == (before.goal.object, "active")
    assert after.surface_voxels > 0.6 * before.surface_voxels
    with safely(search):
        _an_operators_stop_outlives_the_navigator(search, tmp_path / "home.map.run.json")


def _an_operators_stop_outlives_the_navigator(search, run_file):
    search.control("stop")
    search.wait_for(lambda s: s.state == "stopped")
    deadline = time.monotonic() + 20.0
    while b'"held":true' not in run_file.read_bytes():
        assert time.monotonic() < deadline, "the Stop is kept"
        time.sleep(0.02)
    search.navigator.child.kill()
    search.navigator.child.wait()
    search.start_navigator()
    status = search.wait_for(lambda s: s.frames > 3)
    assert status.state == "stopped"
    search.control("resume")
    search.wait_until_moving()


def test_whoever_freezes_or_starves_and_a_link_that_breaks_or_loses_much(search, line):
    for process, share in ((search.navigator, 0.15), (search.robot, 0.3)):
        with safely(search):
            freeze(process, 3.0)
            search.wait_until_moving()
        with safely(search):
            starve(process, 3.0, share=share)
            search.wait_until_moving()
    with safely(search):
        line.cut()
        search.wait_until_moving()
    with safely(search):
        line.latency_s, line.loss = LATENCY_S, LOSS
        time.sleep(8.0)
        line.latency_s, line.loss = 0.0, 0.0
        search.wait_until_moving()


@pytest.mark.large  # Beside busy processes the simulated robot slows down with its link.
def test_a_link_whose_images_are_seconds_late_moves_nothing(search, line):
    # The rate that TCP Reno has left with this latency and loss: what is queued comes in order, at
    # its full rate, and seconds late. Commands that answer it are refused.
    with safely(search):
        line.rate = LossyRelay.reno_rate(LATENCY_S, LOSS)
        search.wait_for(lambda s: any("later than they did" in note for note in s.notes), 40.0)
        before = search.truth().trajectory
        assert search.truth().trajectory == before
        line.rate = None
        search.wait_until_moving()
        search.wait_for(lambda s: not s.notes and s.state != "lost", 60.0)


class Campaign:
    """One fault of each kind, chosen at random."""

    def __init__(self, search, line, launch, seed):
        self._search, self._line, self._launch = search, line, launch
        self._random = random.Random(seed)
        self._recorder = None

    def strike(self):
        """Do one; return its name."""
        name = self._random.choice(
            ["kill", "freeze", "starve", "freeze robot", "starve robot", "cut", "bad link"]
        )
        search, line = self._search, self._line
        match name:
            case "kill":
                search.navigator.child.kill()
                search.navigator.child.wait()
                search.start_navigator()
            case "freeze":
                freeze(search.navigator, 3.0)
            case "starve":
                starve(search.navigator, 5.0)
            case "freeze robot":
                freeze(search.robot, 3.0)
            case "starve robot":
                starve(search.robot, 5.0, share=0.3)
            case "cut":
                line.cut()
            case "bad link":
                line.latency_s, line.loss = LATENCY_S, LOSS
                time.sleep(8.0)
                line.latency_s, line.loss = 0.0, 0.0
        return name


@pytest.mark.large
@pytest.mark.timeout(CAMPAIGN_S + 1200.0)
def test_a_fault_every_twenty_seconds(search, line, launch, tmp_path):
    campaign = Campaign(search, line, launch, seed=1)
    until = time.monotonic() + CAMPAIGN_S
    done, goals, touched = [], 0, 0
    while time.monotonic() < until:
        next_at = time.monotonic() + 20.0
        # The robot touches things without any fault, too: where its camera does not look.
        before = search.truth().collisions
        done.append(campaign.strike())
        # Recovered without a restart: frames come again, and the state says what is done.
        status = search.wait_for(lambda s: s.state != "lost" and s.frames > 3, 20.0)
        assert status.state != "stopped", (done[-3:], status)
        truth = search.truth()
        (tmp_path / "truth.json").write_bytes(msgspec.json.encode(truth))
        assert coasted_s(truth) <= STAND_S, done[-3:]
        assert truth.collisions == before, (done[-3:], truth.trajectory[-1])
        if status.goal is None or status.goal.outcome != "active":
            goals += 1
            search.search(("bed", "sofa", "toilet")[goals % 3])
        sys.stdout.write(
            f"{done[-1]}: {status.state}, {search.memory_mb():.0f} MB, {goals} goals, "
            f"{before - touched} contacts without a fault\n"
        )
        touched = truth.collisions
        time.sleep(max(0.0, next_at - time.monotonic()))
    assert search.memory_mb() < 1200.0
    assert len(done) >= 0.7 * CAMPAIGN_S / 20.0
    assert goals >= CAMPAIGN_S / 300.0
