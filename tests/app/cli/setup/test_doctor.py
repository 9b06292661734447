import json
import sys
from types import SimpleNamespace

import pytest
from mcap.writer import Writer

from app.cli.main import run
from app.cli.options.tools import Doctor
from app.cli.setup import doctor, profile_from_robot
from app.doctor.checks import check_segmentation
from app.doctor.robot import ros_graph
from app.doctor.robot.samples import Samples
from app.errors import UsageError
from app.links.network.session import LinkError
from app.robot_file import template
from ippon import extensions
from ippon.robot import ZED
from ippon.segmentation.config import SegmentationConfig


@pytest.fixture
def listened(monkeypatch):
    """Let the robot be silent, without a network."""
    heard = []

    def listen(_, robot):
        heard.append(robot)
        return Samples(seconds=0.0)

    session = SimpleNamespace(close=lambda: heard.append("closed"))
    monkeypatch.setattr(doctor, "open_client", lambda endpoint: heard.append(endpoint) or session)
    monkeypatch.setattr(doctor, "listen", listen)
    monkeypatch.setattr(doctor, "live_navigators", lambda _: [])
    return heard


def test_a_silent_robot_fails_with_a_line_for_each_stream(listened, capsys):
    command = Doctor(robot="scout", connect="tcp/127.0.0.1:1", json=True)
    assert doctor.run_doctor(command) == doctor.EXIT_UNWELL
    assert listened == ["tcp/127.0.0.1:1", "scout", "closed"]
    lines = json.loads(capsys.readouterr().out)
    assert [one["what"] for one in lines] == ["colour", "depth", "intrinsics", "tf", "commands"]
    assert all(one["verdict"] == "failed" and one["do"] for one in lines)


def test_a_name_that_no_navigator_has_is_said_first(listened, capsys, monkeypatch):
    monkeypatch.setattr(doctor, "live_navigators", lambda _: ["fleet/one", "two"])
    command = Doctor(robot="scout", connect="tcp/127.0.0.1:1", json=True)
    assert doctor.run_doctor(command) == doctor.EXIT_UNWELL
    first = json.loads(capsys.readouterr().out)[0]
    assert (first["what"], first["verdict"]) == ("navigator", "missing")
    assert first["detail"] == "no navigator of scout on this router; there is fleet/one, two"
    assert first["do"] == "name the robot, for example with --robot fleet/one"
    assert listened[1] == "scout"


def test_the_table_says_what_to_do(listened, capsys):
    assert listened == []
    assert doctor.run_doctor(Doctor(robot="scout", connect="tcp/127.0.0.1:1", profile="zed")) == 1
    printed = capsys.readouterr()
    assert printed.err == "checking scout at tcp/127.0.0.1:1, 5 s of its messages …\n"
    out = " ".join(printed.out.split())
    assert "nothing comes on camera/color" in out
    assert "start the driver and the bridge" in out


def test_a_profile_that_is_none_is_refused():
    with pytest.raises(UsageError, match="no robot profile 'scout'"):
        doctor.run_doctor(Doctor(robot="r", connect="tcp/127.0.0.1:1", profile="scout"))


def test_a_navigator_that_does_not_answer_is_told_in_one_line(monkeypatch, capsys):
    def refuse(endpoint):
        raise LinkError(f"no navigator answers at {endpoint}")

    monkeypatch.setattr(doctor, "open_client", refuse)
    monkeypatch.setattr(profile_from_robot, "open_client", refuse)
    for words in (["doctor"], ["profile", "--from-robot", "scout"]):
        assert run([*words, "--connect", "tcp/127.0.0.1:1"]) == 2
        assert capsys.readouterr().err == "ippon: no navigator answers at tcp/127.0.0.1:1\n"


def test_an_installed_network_needs_no_torch_and_one_that_is_not_there_is_missing(
    tmp_path, monkeypatch
):
    config = SegmentationConfig(backend="installed", model="fast-one", device="npu")
    missing = check_segmentation(config, tmp_path)
    assert missing.verdict == "missing"
    assert "'fast-one'" in missing.detail
    network = SimpleNamespace(segment=lambda *_: None)
    monkeypatch.setattr(extensions, "load", lambda *_: lambda *_: network)
    monkeypatch.setitem(sys.modules, "torch", None)
    measured = check_segmentation(config, tmp_path)
    assert measured.verdict == "ok"
    assert measured.detail.endswith("; fast-one on npu")


def test_a_robot_with_rmw_zenoh_has_a_line_for_its_graph(listened, capsys, tmp_path, monkeypatch):
    def refuse(endpoint, _):
        raise LinkError(endpoint)

    monkeypatch.setattr(ros_graph, "open_robot_client", refuse)
    path = tmp_path / "scout.yaml"
    section = "ros2: {middleware: rmw_zenoh, router: tcp/scout:7447}\n"
    path.write_text(template(ZED) + section, encoding="utf-8")
    command = Doctor(robot="r", connect="tcp/127.0.0.1:1", profile=str(path), json=True)
    assert doctor.run_doctor(command) == doctor.EXIT_UNWELL
    assert listened == ["tcp/127.0.0.1:1", "r", "closed"]
    first = json.loads(capsys.readouterr().out)[0]
    assert (first["what"], first["verdict"]) == ("ROS graph", "missing")


def test_a_bag_lists_its_other_topics_with_their_types(tmp_path, capsys):
    path = tmp_path / "bag.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        for name, kind, count in (
            ("/tf", "tf2_msgs/msg/TFMessage", 3),
            ("/front/rgb", "sensor_msgs/msg/Image", 2),
            ("/scan[0]", "sensor_msgs/msg/LaserScan", 1),
        ):
            schema = writer.register_schema(kind, "ros2msg", b"")
            channel = writer.register_channel(name, "cdr", schema)
            for n in range(count):
                writer.add_message(channel, n + 1, b"\0\1\0\0\0\0\0\0", n + 1)
        writer.finish()
    assert run(["doctor", str(path)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert "  3 messages of known topics, 0.0 s" in lines
    assert lines[lines.index("  topics that are not used:") + 1 :] == [
        "    /front/rgb (sensor_msgs/msg/Image), 2 messages",
        "    /scan[0] (sensor_msgs/msg/LaserScan), 1 messages",
    ]
    run(["doctor", "--json", str(path)])
    assert json.loads(capsys.readouterr().out)["others"][0] == {
        "topic": "/front/rgb",
        "type": "sensor_msgs/msg/Image",
        "messages": 2,
    }


def test_a_bag_without_a_known_topic_names_what_it_has(tmp_path, capsys):
    path = tmp_path / "bag.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        for n in range(22):
            schema = writer.register_schema("sensor_msgs/msg/LaserScan", "ros2msg", b"")
            writer.add_message(writer.register_channel(f"/scan{n:02}", "cdr", schema), 1, b"\0", 1)
        writer.finish()
    assert run(["doctor", str(path)]) == 2
    told = capsys.readouterr().err
    assert "it has /scan00 (sensor_msgs/msg/LaserScan), /scan01" in told
    assert "/scan19 (sensor_msgs/msg/LaserScan), …, and a recording" in told


def test_packages_are_listed_with_licence_size_and_reason(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")
    assert doctor.run_doctor(Doctor(licences=True)) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    (row,) = [line for line in printed.out.splitlines() if " llvmlite " in line]
    assert "BSD" in row
    assert "needed by numba" in row
    assert "compiles the kernels" in printed.out


def test_packages_are_listed_for_programs_too(capsys):
    assert doctor.run_doctor(Doctor(licences=True, json=True)) == 0
    (viser,) = [one for one in json.loads(capsys.readouterr().out) if one["name"] == "viser"]
    assert viser["licence"] == "MIT License"
    assert viser["megabytes"] > 1.0
    assert viser["texts"]


@pytest.mark.parametrize("more", [{"robot": "scout"}, {"recording": "x"}, {"segmentation": True}])
def test_a_list_of_packages_goes_with_no_check(more):
    with pytest.raises(UsageError, match="--licences"):
        doctor.run_doctor(Doctor(licences=True, **more))
