"""`ippon recognise` on real images through a trained detector."""

import json
import math
import re
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from app.cli.main import run
from app.cli.tools import recognise as command
from app.recognition import page as page_module
from app.recognition.frames import Tally, open_source
from app.recognition.recognition import Recognition, labels_of
from ippon.camera import PinholeCamera
from ippon.frame import Frame
from ippon.geometry import R_BASE_CAMERA_LEVEL, make_transform
from ippon.observation import Detections, Heatmap, Instance
from ippon.observation_model import NOT_RECOGNISED
from ippon.segmentation.detectors.vocabulary import ClosedVocabulary
from ippon.tracking.upright import UprightCheck
from tests.locations import ROOT, SHARED

SEQUENCE = SHARED / "rgbd/redkitchen_a"
MODEL = SHARED / "models/nanodet_plus_m_416/nanodet-plus-m_416.param"
ABSENT = ("sofa", "bed", "toilet", "teddy_bear", "refrigerator", "backpack", "vase", "laptop")


def every_nth_image(folder, n):
    """Write a recording with some of the kitchen's images, which show the same; return it."""
    for name in ("color", "depth", "objects.json"):
        (folder / name).symlink_to(SEQUENCE / name)
    sequence = json.loads((SEQUENCE / "sequence.json").read_text())
    sequence["frames"] = sequence["frames"][::n]
    (folder / "sequence.json").write_text(json.dumps(sequence))
    return folder


def recognise(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "app", "recognise", *arguments],
        cwd=ROOT, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip


CAMERA = PinholeCamera(width=160, height=120, fx=150.0, fy=150.0, cx=79.5, cy=59.5)


def on_a_wall(scores, asked, gives=None, also=None):
    """Return what is found on a wall 1.5 m away; of some images a detector sees a cup on it."""
    recognition = Recognition(asked, memory_limit_mb=128.0)
    T_world_camera = make_transform(R_BASE_CAMERA_LEVEL, (0.0, 0.0, 1.0))
    known = ("wall", *(gives or asked))
    for n, score in enumerate(scores):
        frame = Frame(
            stamp_ns=n * 10**8,
            color=np.zeros((120, 160, 3), np.uint8),
            depth=np.full((120, 160), 1.5, np.float32),
            camera=CAMERA,
            T_world_camera=T_world_camera,
            T_world_base=T_world_camera,
            tilt_rad=0.0,
        )
        cup = Instance(label="cup", score=score, box_px=(70.0, 50.0, 90.0, 70.0))
        seen = Detections(
            source="x", labels=known, ooi=None, image_size=(120, 160),
            instances=(*([cup] if score else []), *([also] if also else [])),
        )  # fmt: skip
        recognition.add(frame, seen)
    return recognition.finds("cup"), recognition.map_of("cup").best_ooi()


def test_a_find_does_not_depend_on_what_else_is_asked_for():
    alone, best = on_a_wall([0.45] * 8, ["cup"])
    assert len(alone) == 1
    others = [f"thing_{n}" for n in range(60)]
    assert on_a_wall([0.45] * 8, ["cup", *others[:3]]) == (alone, best)
    assert on_a_wall([0.45] * 8, ["cup", *others[:8]]) == (alone, best)
    vase = Instance(label="vase", score=0.9, box_px=(71.0, 51.0, 89.0, 69.0))
    finds, _ = on_a_wall([0.45] * 8, ["cup", "vase"], also=vase)
    assert finds == alone, "what else is seen in its place is another matter"


def test_what_most_images_do_not_recognise_is_no_find_although_the_map_believes_it():
    finds, best = on_a_wall([0.0, 0.9, 0.9, 0.0, 0.0, 0.0, 0.0, 0.0], ["cup"])
    assert best > 0.9
    assert finds == ()
    finds, _ = on_a_wall([0.0, 0.9, 0.9, 0.0, 0.9, 0.9, 0.0, 0.0], ["cup"])
    assert len(finds) == 1


def test_an_object_under_another_name_than_that_of_its_class_is_not_silently_missed():
    detector = _Fake(knows=("tv", "cup"))
    assert labels_of(detector, ["monitor", "cup", "unicorn"]) == {"monitor": "tv", "cup": "cup"}
    with pytest.raises(ValueError, match="does not give the label monitor: `labels_of` returns"):
        on_a_wall([0.45], ["monitor"], gives=("cup", "tv"))


def test_two_names_of_one_thing_do_not_compete_in_a_network_that_takes_any_words():
    names = ["couch", "sofa", "hat", "cap", "red_cap", "settee", "smartphone", "mobile"]
    assert labels_of(object(), names) == {
        "couch": "sofa", "sofa": "sofa", "hat": "hat", "cap": "cap", "red_cap": "red_cap",
        "settee": "sofa", "smartphone": "smartphone", "mobile": "smartphone",
    }  # fmt: skip


@pytest.mark.slow
@pytest.mark.skipif(not (SEQUENCE.exists() and MODEL.exists()), reason="needs the shared images")
def test_a_real_kitchen_holds_what_is_in_it_and_nothing_that_is_not(tmp_path):
    pytest.importorskip("ncnn")
    kinds = ("cup", "tv", "chair", "table", "book", "bottle", *ABSENT, "hat")
    ran = recognise(
        str(every_nth_image(tmp_path, 3)), "--find", ",".join(kinds), "--json",
        "--page", str(tmp_path / "page.html"),
        "--segmentation.backend", "detector", "--segmentation.model", str(MODEL),
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    lines = [json.loads(line) for line in ran.stdout.splitlines()]
    assert [line["object"] for line in lines] == list(kinds)
    assert "'hat' is none of them" in ran.stderr
    finds = {line["object"]: [f["position_world"] for f in line["finds"]] for line in lines}
    page = (tmp_path / "page.html").read_text()
    assert page.count('class="find"') == sum(map(len, finds.values()))
    assert page.count("<figure>") > 20
    assert "this network does not recognise it" in page
    assert re.search(r"together: p (0\.9|1\.0)", page)
    truth = json.loads((SEQUENCE / "objects.json").read_text())["objects"]

    def near(kind, position, within_m):
        return [
            n for n, o in enumerate(truth)
            if o["label"] == kind and math.dist(o["centre_world"], position) < within_m
        ]  # fmt: skip

    assert all(near("cup", at, 0.3) for at in finds["cup"])
    assert len({n for at in finds["cup"] for n in near("cup", at, 0.3)}) == 2
    assert all(near("tv", at, 0.7) for at in finds["tv"])
    assert all(near("book", at, 0.3) for at in finds["book"])
    assert len(finds["tv"]) == len(finds["table"]) == len(finds["book"]) == 1
    assert all(near("chair", at, 0.45) for at in finds["chair"])
    assert len({n for at in finds["chair"] for n in near("chair", at, 0.45)}) == 4
    assert all(finds[kind] == [] for kind in (*ABSENT, "hat", "bottle"))


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("/nowhere", "--find", "cup"), "/nowhere does not exist"),
        ((str(ROOT / "docs"), "--find", "cup"), "is not a known dataset"),
        ((str(ROOT), "--find", " , "), "--find takes comma-separated objects"),
        (("/nowhere", "--find", "cup", "--page", "/nowhere/page.html"), "folder /nowhere does not"),
    ],
)
def test_what_cannot_be_recognised_says_why(arguments, text, capsys):
    assert run(["recognise", *arguments]) == 2
    assert text in capsys.readouterr().err


class _Fake:
    """A detector that sees nothing, and counts its images."""

    def __init__(self, *, knows):
        self.vocabulary, self.images = ClosedVocabulary.of(knows), 0

    def segment(self, color, labels, ooi):
        self.images += 1
        return Detections(
            source="own", labels=tuple(labels), ooi=ooi, image_size=color.shape[:2], instances=()
        )


@pytest.fixture
def fake(tmp_path, monkeypatch):
    Image.fromarray(np.zeros((120, 160, 3), np.uint8)).save(tmp_path / "0.png")
    Image.fromarray(np.full((120, 160), 1500, np.uint16)).save(tmp_path / "0.depth.png")
    pose = make_transform(R_BASE_CAMERA_LEVEL, (0.0, 0.0, 1.0)).tolist()
    content = {
        "name": "wall", "width": 160, "height": 120, "depth_unit_m": 0.001, "rate_hz": 10.0,
        "intrinsics": {"fx": 150.0, "fy": 150.0, "cx": 79.5, "cy": 59.5},
        "gravity_world": [0, 0, -1],
        "frames": [{"color": "0.png", "depth": "0.depth.png", "camera_to_world": pose}],
    }  # fmt: skip
    (tmp_path / "sequence.json").write_text(json.dumps(content))
    network = _Fake(knows=("cup",))
    monkeypatch.setattr(command, "segmenter_of", lambda _: network)
    return network


def test_an_object_is_found_by_any_name_of_its_class(fake, tmp_path, capsys):
    fake.vocabulary = ClosedVocabulary.of(("tv", "cup"))
    assert run(["recognise", str(tmp_path), "--find", "monitor,mug,cup,,Cup,unicorn"]) == 0
    assert capsys.readouterr().out == "monitor: none\nmug: none\ncup: none\nunicorn: none\n"


MODEL_TEXT = """{"source": "SOURCE", "kind": "scores", "provenance": "by hand",
 "table": {"scores": [0.3, 0.6], "nats": [0, 6], "not_recognised": -0.5}}"""


def test_an_observation_model_of_another_network_is_refused(fake, tmp_path, capsys):
    (tmp_path / "own.json").write_text(MODEL_TEXT.replace("SOURCE", "own"))
    (tmp_path / "other.json").write_text(MODEL_TEXT.replace("SOURCE", "other"))
    arguments = ["recognise", str(tmp_path), "--find", "cup", "--observation-model"]
    assert run([*arguments, str(tmp_path / "own.json")]) == 0
    assert "weak score" not in capsys.readouterr().err
    (tmp_path / "fell.json").write_text(
        MODEL_TEXT.replace("SOURCE", "own").replace("[0, 6]", "[-2, 6]")
    )
    assert run([*arguments, str(tmp_path / "fell.json")]) == 0
    assert "ippon: fell.json: a weak score of other labels told more" in capsys.readouterr().err
    assert run([*arguments, str(tmp_path / "other.json")]) == 2
    assert "the observation model is that of 'other'" in capsys.readouterr().err
    for backend, network in (
        ("detector", "'own' (scores)"), ("owlv2", "'owlv2' (scores)"),
        ("clipseg", "'clipseg' (scores)"), ("sam3-lite", "'sam3-lite' (scores)"),
        ("grounding-dino", "'grounding-dino' (scores)"), ("san", "'san' (distribution)"),
    ):  # fmt: skip
        where = ["--segmentation.where", "here", "--segmentation.backend", backend]
        arguments = ["navigate", *where, "--segmentation.model", "a/own.onnx"]
        assert run([*arguments, "--observation-model", str(tmp_path / "other.json")]) == 2
        assert f"and the network is {network}" in capsys.readouterr().err


@pytest.mark.parametrize(("asked", "status"), [("cup,lamp", 0), ("lamp", 2)])
def test_an_installed_network_without_a_vocabulary_may_know_few_labels(
    fake, tmp_path, capsys, asked, status
):
    del fake.vocabulary
    seen = Detections(source="own", labels=("cup",), ooi=None, image_size=(120, 160), instances=())
    fake.segment = lambda *_: seen
    arguments = ["--segmentation.backend", "installed", "--segmentation.model", "own"]
    assert run(["recognise", str(tmp_path), "--find", asked, *arguments]) == status
    ran = capsys.readouterr()
    assert ran.out == "".join(f"{name}: none\n" for name in asked.split(","))
    assert ran.err.count("ippon: this network gives no label") == 1
    assert "this network gives no label 'lamp'" in ran.err


def test_no_image_is_looked_at_for_what_the_network_cannot_tell(fake, tmp_path, capsys):
    assert run(["recognise", str(tmp_path), "--find", "unicorn"]) == 2
    assert fake.images == 0
    ran = capsys.readouterr()
    assert ran.out == "unicorn: none\n"
    assert "'unicorn' is none of them" in ran.err


def test_images_that_were_left_out_are_counted_once_with_a_page_too(
    fake, tmp_path, monkeypatch, capsys
):
    """The page reads the recording again, until it has its images."""
    cup = Instance(label="cup", score=0.2, box_px=(70.0, 50.0, 90.0, 70.0))
    seen = Detections(
        source="own", labels=("cup",), ooi=None, image_size=(120, 160), instances=(cup,)
    )
    fake.segment = lambda *_: seen
    read = open_source(tmp_path)

    class Bag:
        """Nine images, of which one becomes a frame."""

        tally = Tally()

        def __getattr__(self, name):
            return getattr(read, name)

        def frames(self):
            self.tally.images = self.tally.frames = 0
            for n, frame in enumerate([*read.frames()] * 9):
                self.tally.images += 1
                if n == 2:
                    self.tally.frames += 1
                    yield frame

    monkeypatch.setattr(command, "open_source", lambda *_, **__: Bag())
    page = tmp_path / "page.html"
    assert run(["recognise", str(tmp_path), "--find", "cup", "--page", str(page)]) == 0
    assert "<figure>" in page.read_text()
    assert "8 of 9 colour images were not mapped" in capsys.readouterr().err


def test_refused_frames_and_images_that_are_upside_down_are_told(
    fake, tmp_path, monkeypatch, capsys
):
    read = json.loads((tmp_path / "sequence.json").read_text())
    (frame,) = read["frames"]
    pose = np.array(frame["camera_to_world"])
    pose[0, 3] = 3e4
    frames = [frame, {**frame, "camera_to_world": pose.tolist()}]
    (tmp_path / "sequence.json").write_text(json.dumps({**read, "frames": frames}))
    monkeypatch.setattr(UprightCheck, "is_upside_down", True)
    assert run(["recognise", str(tmp_path), "--find", "cup"]) == 0
    told = capsys.readouterr().err
    assert "1 of 2 frames were refused; the last one: camera at (30000.00, 0.00" in told
    assert "the camera's images are upside down" in told
    assert "the world of the poses" not in told
    monkeypatch.setattr(UprightCheck, "is_world_upside_down", True)
    assert run(["recognise", str(tmp_path), "--find", "cup"]) == 2
    assert "gravity_world is the direction in which things fall" in capsys.readouterr().err
    monkeypatch.setattr("app.recognition.frames.align_to_floor", lambda *_: np.eye(4))
    assert run(["recognise", str(tmp_path), "--find", "cup"]) == 0
    assert "the world of the poses is upside down" in capsys.readouterr().err


def test_a_network_whose_boxes_are_mostly_invalid_is_told(fake, tmp_path, capsys):
    cup = Instance(label="cup", score=0.2, box_px=(70.0, 50.0, 90.0, 70.0))
    seen = Detections(
        source="own", labels=("cup",), ooi=None, image_size=(120, 160), instances=(cup,), dropped=1
    )
    fake.segment = lambda *_: seen
    assert run(["recognise", str(tmp_path), "--find", "cup"]) == 0
    assert "boxes" not in capsys.readouterr().err
    fake.segment = lambda *_: replace(seen, dropped=40)
    assert run(["recognise", str(tmp_path), "--find", "cup"]) == 0
    assert "40 boxes of the network were not used, being outside the" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("unit_m", "millimetres", "note"),
    [
        (0.001, 1500, ""),
        (1.0, 1500, "the depth of the images is 1500 m (median)"),
        (0.00001, 1500, "the depth of the images is 0.015 m (median)"),
        (0.001, 0, "no image has any depth"),
    ],
)
def test_depth_of_another_unit_is_told(fake, tmp_path, capsys, unit_m, millimetres, note):
    del fake
    read = json.loads((tmp_path / "sequence.json").read_text())
    (tmp_path / "sequence.json").write_text(json.dumps(read | {"depth_unit_m": unit_m}))
    depth = np.full((120, 160), millimetres, np.uint16)
    Image.fromarray(depth).save(tmp_path / "0.depth.png")
    assert run(["recognise", str(tmp_path), "--find", "cup"]) == 0
    told = capsys.readouterr().err
    assert note in told
    assert bool(note) == ("depth" in told)


def test_a_page_takes_images_whose_sides_are_no_multiples_of_each_other(fake, tmp_path, capsys):
    Image.fromarray(np.zeros((480, 848, 3), np.uint8)).save(tmp_path / "0.png")
    Image.fromarray(np.full((480, 848), 1500, np.uint16)).save(tmp_path / "0.depth.png")
    read = json.loads((tmp_path / "sequence.json").read_text())
    read |= {"width": 848, "height": 480}
    read["intrinsics"] = {"fx": 600.0, "fy": 600.0, "cx": 423.5, "cy": 239.5}
    (tmp_path / "sequence.json").write_text(json.dumps(read))
    cup = Instance(label="cup", score=0.9, box_px=(380.0, 200.0, 460.0, 280.0))
    fake.segment = lambda *_: Detections(
        source="own", labels=("cup",), ooi=None, image_size=(480, 848), instances=(cup,)
    )
    page = tmp_path / "page.html"
    assert run(["recognise", str(tmp_path), "--find", "cup", "--page", str(page)]) == 0
    assert capsys.readouterr().out.startswith("cup: 1\n")
    assert page.read_text().count('class="find"') == 1


def test_a_page_of_a_network_without_instances_says_nothing_of_them(
    tmp_path, monkeypatch, fake, capsys
):
    del fake

    class Dense:
        """Scores the middle of every image as a cup."""

        def segment(self, color, labels, ooi):
            scores = np.full((12, 16, len(labels)), NOT_RECOGNISED, np.uint8)
            scores[5:7, 7:9, labels.index("cup")] = 200
            return Heatmap(labels=labels, ooi=ooi, probabilities=scores, kind="scores", source="x")

    monkeypatch.setattr(command, "segmenter_of", lambda _: Dense())
    page = tmp_path / "page.html"
    assert run(["recognise", str(tmp_path), "--find", "cup,hat", "--page", str(page)]) == 0
    assert re.search(r"^  p 0\.\d\d at .* m long$", capsys.readouterr().out, re.MULTILINE)
    text = page.read_text()
    assert text.count('class="find"') == 1
    assert "<p>No find.</p>" in text
    assert "Recognised in" not in text
    assert "recognised it in no image" not in text


def test_the_finds_of_two_words_for_one_class_have_one_mark(fake, tmp_path, monkeypatch):
    cup = Instance(label="cup", score=0.9, box_px=(70.0, 50.0, 90.0, 70.0))
    seen = Detections(
        source="own", labels=("cup",), ooi=None, image_size=(120, 160), instances=(cup,)
    )
    fake.segment = lambda *_: seen
    drawn = []
    monkeypatch.setattr(page_module, "plan", lambda _, marks: drawn.extend(marks))
    page = tmp_path / "page.html"
    assert run(["recognise", str(tmp_path), "--find", "cup,mug", "--page", str(page)]) == 0
    assert [text for text, _ in drawn] == ["1, 2"]
    assert page.read_text().count('class="find"') == 2
