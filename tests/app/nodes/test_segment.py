"""The segmentation process: labels and images over a real link, heatmaps back."""

import threading
import time

import numpy as np
import pytest
import zenoh

from app.links.network.latched_topic import LatchedTopic
from app.links.network.sender import Sender
from app.links.network.session import LinkError, open_client
from app.links.network.subscription import subscribe
from app.messages import keys
from app.messages.control import encode
from app.messages.images import encode_color
from app.messages.perception.detection_masks import decode_masks_compressed
from app.messages.perception.detections import decode_detections
from app.messages.perception.detector_info import decode_detector_name, decode_label_names
from app.messages.perception.heatmaps import decode_heatmap
from app.messages.status import SegmentationLabels
from app.nodes import segment
from app.nodes.segment import SegmentConfig, SegmentNode
from ippon.observation import Detections, Heatmap, Instance
from ippon.segmentation.detectors.vocabulary import ClosedVocabulary
from ippon.segmentation.errors import OutOfMemoryError
from tests.app.relay import Relay

OPTICAL = "camera_color_optical_frame"
PATIENCE_S = 20.0


class Slow:
    """Takes its time, so that images overtake one another; can be told to fail."""

    def __init__(self):
        self.go = threading.Event()
        self.fails = False
        self.asked = []

    def segment(self, color, labels, ooi):
        self.asked.append((tuple(labels), ooi))
        assert self.go.wait(PATIENCE_S)
        if self.fails:
            raise OutOfMemoryError("memory ran out in the test")
        p = np.zeros((6, 8, len(labels) + 1), np.uint8)
        p[..., -1] = 255
        return Heatmap(labels=tuple(labels), ooi=ooi, probabilities=p)


def image(stamp_ns):
    return encode_color(np.full((48, 64, 3), 90, np.uint8), stamp_ns, OPTICAL)


def wait_until(condition):
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.fixture
def wired(sessions):
    """A navigator's side that asks for labels, and a segmentation that runs."""
    router, client = sessions
    sender, token = Sender(), router.liveliness().declare_token(f"r/{keys.NAVIGATOR_ALIVE}")
    labels = LatchedTopic(router, f"r/{keys.LABELS}", sender)
    labels.put(encode(SegmentationLabels(labels=["wall", "sofa"], ooi="hat")))
    heatmaps = []
    subscribe(router, f"r/{keys.HEATMAP}", lambda p: heatmaps.append(decode_heatmap(p)))
    network, stop = Slow(), threading.Event()
    node = SegmentNode(SegmentConfig(connect="", robot="r", keep=2), client, network)
    thread = threading.Thread(target=node.run, args=(stop,))
    thread.start()
    wait_until(lambda: node._labels is not None)
    yield router, labels, heatmaps, network, node
    network.go.set()
    stop.set()
    thread.join(PATIENCE_S)
    token.undeclare()
    sender.close()


def test_the_newest_image_is_segmented_and_keeps_its_stamp(wired):
    router, _, heatmaps, network, node = wired
    router.put(f"r/{keys.COLOR}", image(1))
    wait_until(lambda: network.asked)
    for stamp in (2, 3, 4):
        router.put(f"r/{keys.COLOR}", image(stamp))
    wait_until(lambda: node.skipped == 2)
    network.go.set()
    wait_until(lambda: len(heatmaps) == 2)
    assert [h.stamp_ns for h in heatmaps] == [1, 4]
    assert heatmaps[0].heatmap.ooi == "hat"
    assert (heatmaps[0].heatmap.probabilities[..., -1] == 255).all()


def test_instances_are_sent_as_detections_with_names_and_masks(wired, monkeypatch):
    router, _, heatmaps, network, _ = wired
    came = {}
    for key in (keys.BOXES, keys.MASKS_COMPRESSED, keys.LABEL_NAMES, keys.DETECTOR_NAME):
        kept = key in (keys.LABEL_NAMES, keys.DETECTOR_NAME)
        subscribe(router, f"r/{key}", lambda p, k=key: came.update({k: p}), kept=kept)
    mask = np.zeros((24, 32), np.bool_)
    mask[:12, :16] = True
    one = Instance(label="hat", score=0.9, box_px=(0.0, 0.0, 32.0, 24.0), mask=mask)

    def segment(color, labels, ooi):
        return Detections(
            source="boxes",
            labels=(*labels, ooi),
            ooi=ooi,
            image_size=color.shape[:2],
            instances=(one,),
        )

    monkeypatch.setattr(network, "segment", segment)
    router.put(f"r/{keys.COLOR}", image(1))
    wait_until(lambda: len(came) == 4)
    boxes = decode_detections(came[keys.BOXES])
    assert (boxes.stamp_ns, boxes.names, boxes.scores[0]) == (1, ("hat",), 0.9)
    masks = decode_masks_compressed(came[keys.MASKS_COMPRESSED])
    assert masks.stamp_ns == 1
    assert (masks.numbers == 1).sum() == 12 * 16
    names = decode_label_names(came[keys.LABEL_NAMES]).names
    assert list(names.values()) == ["wall", "sofa", "hat"]
    assert decode_detector_name(came[keys.DETECTOR_NAME]) == "boxes"
    assert heatmaps == []


class Names:
    """A detector that sees nothing of some classes."""

    def __init__(self, vocabulary, labels=()):
        self.labels = labels
        if vocabulary is not None:
            self.vocabulary = vocabulary

    def segment(self, color, labels, ooi):
        return Detections(
            source="x", labels=self.labels, ooi=None, image_size=color.shape[:2], instances=()
        )


@pytest.mark.parametrize(
    ("network", "names"),
    [
        (Names(ClosedVocabulary(("ding", "cup"), (("mug", "jar"), ("cup",)))), ["mug/jar", "cup"]),
        (Names(ClosedVocabulary(("x",), (("mug", "a" * 80),))), ["mug", "a" * 80]),
        (Names(None), None),
    ],
)  # fmt: skip
def test_label_info_says_what_classes_answer_to(sessions, network, names):
    router, client = sessions
    came = []
    for key in (keys.LABEL_NAMES, keys.BOXES):
        kept = key == keys.LABEL_NAMES
        subscribe(router, f"r/{key}", lambda p, k=key: came.append((k, p)), kept=kept)
    node = SegmentNode(SegmentConfig(connect="", robot="r"), client, network)
    node._segment(image(1), SegmentationLabels(labels=["wall"], ooi="mug"))
    wait_until(lambda: keys.BOXES in dict(came) and (not names or keys.LABEL_NAMES in dict(came)))
    told = dict(came).get(keys.LABEL_NAMES)
    assert (told and list(decode_label_names(told).names.values())) == names


def test_scores_are_sent_whole_with_the_name_of_their_network(wired, monkeypatch):
    router, _, heatmaps, network, _ = wired

    def segment(color, labels, ooi):
        p = np.zeros((6, 8, len(labels) + 1), np.uint8)
        p[..., 0], p[..., 1], p[..., -1] = 90, 1, 40
        return Heatmap(
            labels=tuple(labels), ooi=ooi, probabilities=p, kind="scores", source="clipseg"
        )

    monkeypatch.setattr(network, "segment", segment)
    router.put(f"r/{keys.COLOR}", image(1))
    wait_until(lambda: heatmaps)
    seen = heatmaps[0].heatmap
    assert (seen.kind, seen.source) == ("scores", "clipseg")
    assert seen.probabilities[3, 3].tolist() == [90, 1, 40]


def test_what_a_detector_cannot_tell_is_said_once(wired, caplog):
    _, labels, _, network, node = wired
    network.vocabulary = ClosedVocabulary.of(["cup", "chair"])
    for ooi, others in (("crown", ["wall"]), ("crown", ["wall", "bed"]), ("mug", ["wall"])):
        labels.put(encode(SegmentationLabels(labels=others, ooi=ooi)))
        wait_until(lambda o=ooi, n=others: (node._labels.ooi, node._labels.labels) == (o, n))
    said = [r.getMessage() for r in caplog.records if "is none of them" in r.getMessage()]
    assert said == [network.vocabulary.unsupported_reason("crown")]
    assert said[0].startswith("this detector knows 2 kinds of thing and 'crown' is none of them")


def test_labels_change_from_one_image_to_the_next(wired):
    router, labels, heatmaps, network, node = wired
    network.go.set()
    router.put(f"r/{keys.COLOR}", image(1))
    wait_until(lambda: heatmaps)
    labels.put(encode(SegmentationLabels(labels=["wall"], ooi="mug")))
    wait_until(lambda: node._labels.ooi == "mug")
    router.put(f"r/{keys.COLOR}", image(2))
    wait_until(lambda: len(heatmaps) == 2)
    assert network.asked == [(("wall", "sofa"), "hat"), (("wall",), "mug")]


def test_a_search_that_begins_while_the_line_is_cut_is_not_lost(sessions, free_endpoint):
    router, _ = sessions
    relay = Relay(int(free_endpoint.rsplit(":", 1)[1]))
    token = router.liveliness().declare_token(f"r/{keys.NAVIGATOR_ALIVE}")
    sender, stop = Sender(), threading.Event()
    labels = LatchedTopic(router, f"r/{keys.LABELS}", sender)
    labels.put(encode(SegmentationLabels(labels=["wall"], ooi=None)))
    client = open_client(f"tcp/127.0.0.1:{relay.port}")
    node = SegmentNode(SegmentConfig(connect="", robot="r", keep=2), client, Slow())
    thread = threading.Thread(target=node.run, args=(stop,))
    thread.start()
    try:
        wait_until(lambda: node._labels is not None)
        relay.lets_in = False
        relay.cut()
        labels.put(encode(SegmentationLabels(labels=["wall"], ooi="hat")))
        assert node._labels.ooi is None
        relay.lets_in = True
        wait_until(lambda: node._labels.ooi == "hat")
    finally:
        stop.set()
        thread.join(PATIENCE_S)
        client.close()
        sender.close()
        token.undeclare()
        relay.close()


def test_further_objects_of_interest_are_asked_for_as_labels(wired, caplog):
    router, labels, heatmaps, network, node = wired
    network.vocabulary = ClosedVocabulary.of(["wall", "mug"])
    network.go.set()
    labels.put(encode(SegmentationLabels(labels=["wall"], ooi="mug", also=["crown"])))
    wait_until(lambda: node._labels.ooi == "mug")
    router.put(f"r/{keys.COLOR}", image(1))
    wait_until(lambda: heatmaps)
    assert network.asked == [(("wall", "crown"), "mug")]
    assert "'crown' is none of them" in caplog.text


def test_a_failure_costs_its_image_alone_and_is_said_once(wired, caplog):
    router, _, heatmaps, network, node = wired
    network.go.set()
    network.fails = True
    for count, payload in enumerate((image(1), image(2), b"no image"), start=1):
        router.put(f"r/{keys.COLOR}", payload)
        wait_until(lambda n=count: node.failed == n)
    network.fails = False
    router.put(f"r/{keys.COLOR}", image(3))
    wait_until(lambda: heatmaps)
    assert heatmaps[0].stamp_ns == 3
    said = [r.getMessage() for r in caplog.records if "was not segmented" in r.getMessage()]
    assert len(said) == 2
    assert "memory ran out in the test" in said[0]


def test_labels_that_are_none_are_skipped(wired):
    router, _, _, _, node = wired
    router.put(f"r/{keys.LABELS}", b"{}")
    wait_until(lambda: node.failed == 1)
    assert node._labels.ooi == "hat"


def test_names_that_are_sent_once_are_not_dropped(wired):
    *_, node = wired
    for publisher in node._kept.values():
        assert publisher.congestion_control == zenoh.CongestionControl.BLOCK


def test_waiting_for_the_navigator_is_told_once_and_pauses(free_endpoint, monkeypatch, caplog):
    caplog.set_level("INFO", logger=segment.__name__)
    tries, pauses = iter([LinkError("nobody"), LinkError("nobody"), None]), []

    def open_client(*_, **__):
        if (error := next(tries)) is not None:
            raise error
        return "session"

    monkeypatch.setattr(segment, "open_client", open_client)
    stop = threading.Event()
    monkeypatch.setattr(stop, "wait", pauses.append)
    config = SegmentConfig(connect=free_endpoint, robot="r")
    assert segment._connected(config, stop) == "session"
    assert pauses == [segment.RETRY_S] * 2
    assert caplog.messages == ["waiting up to 300 s for the navigator: nobody"]


def test_numbers_of_labels_that_cannot_be_sent_are_refused():
    with pytest.raises(ValueError, match="1 to 512 labels of each pixel are sent; got 0"):
        SegmentConfig(connect="", robot="r", keep=0)
