import time

from app.links.robot_streams.stream_monitor import WINDOW, StreamMonitor


def test_a_stream_that_never_spoke():
    status = StreamMonitor("depth").status()
    assert (status.name, status.age_s, status.rate_hz) == ("depth", None, 0.0)


def test_rate_and_age(monkeypatch):
    now = 100.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    monitor = StreamMonitor("depth")
    for _ in range(3 * WINDOW):
        now += 0.2
        monitor.arrived()
    now += 0.5
    status = monitor.status()
    assert abs(status.rate_hz - 5.0) < 1e-6
    assert abs(status.age_s - 0.5) < 1e-6
    assert abs(monitor.age_s() - 0.5) < 1e-6


def test_drops_and_refusals_are_counted():
    monitor = StreamMonitor("depth")
    monitor.dropped()
    monitor.dropped(2)
    assert [monitor.rejected("torn"), monitor.rejected("empty")] == [1, 2]
    status = monitor.status()
    assert (status.dropped, status.rejected, monitor.last_problem) == (3, 2, "empty")
