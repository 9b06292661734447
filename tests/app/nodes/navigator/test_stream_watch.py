from types import SimpleNamespace

from app.nodes.navigator import stream_watch
from app.nodes.navigator.config import NavigatorConfig
from app.nodes.navigator.stream_watch import StreamWatch


def test_a_segmentation_that_never_speaks_is_reported_once(monkeypatch):
    clock = SimpleNamespace(now=50.0)
    monkeypatch.setattr(stream_watch.time, "monotonic", lambda: clock.now)
    heatmap = SimpleNamespace(age_s=lambda: None)
    monitors = {"heatmap": heatmap, "colour": SimpleNamespace(age_s=lambda: 0.1)}
    intake = SimpleNamespace(monitors=monitors, frames=0)
    events = []
    watch = StreamWatch(NavigatorConfig(robot="r"), intake, lambda *e: events.append(e), list)

    def after(seconds):
        clock.now += seconds
        watch.check_heatmap(searching=True)
        return watch.notes()

    assert after(0.0) == after(100.0) == (), "without frames nothing is missed"
    intake.frames = 1
    assert after(2.9) == ()
    assert after(0.2) == after(5.0) == ("no heatmap: " + stream_watch.NO_HEATMAP,)
    heatmap.age_s = lambda: 0.1
    assert after(0.1) == ()
    assert events == [
        ("stream_lost", f"no heatmap has come: {stream_watch.NO_HEATMAP}"),
        ("stream_back", "heatmap is back"),
    ]


def test_what_frames_lack_is_told_with_its_age():
    lost = []
    intake = SimpleNamespace(frames=1, ended="", lost=lambda _: list(lost))
    events, drops = [], []
    config = NavigatorConfig(robot="r", lost_s=1.0)
    watch = StreamWatch(config, intake, lambda *e: events.append(e), lambda: drops.append(1))
    # All streams arrive: what lacks is none of them.
    for age_s in (1.5, 2.0):
        lost[:] = [("camera info", age_s)]
        watch.check_required()
        assert watch.lost == [("camera info", age_s)]
    lost.clear()
    watch.check_required()
    assert not watch.lost
    assert len(drops) == 1
    assert events == [
        ("stream_lost", "no camera info for 1 s: waiting"),
        ("stream_back", "camera info is back"),
    ]
