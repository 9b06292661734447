"""What each role of `ippon certificates` can do, and what it cannot."""

import datetime as dt
import queue
import threading
import time

import msgspec
import pytest

from app.certificates.roles import write_roles
from app.links.network.requests import ask, last_message, serve
from app.links.network.session import PROFILE, LinkError, open_client, open_router
from app.links.network.subscription import is_alive, subscribe
from app.messages import keys
from app.messages.control import Accepted, ControlReply, ControlRequest, FeedbackRequest
from app.messages.recording import RecordingStatus, RecordRequest
from app.nodes.recorder import Recorder, RecorderConfig
from app.recording.writing.limits import RecordingLimits
from app.ros2.ippon_ros2 import zenoh_side
from app.ros2.ippon_ros2.zenoh_side import stream_publisher


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Certificates of one authority, and one by a stranger's."""
    folder, other = tmp_path_factory.mktemp("tls"), tmp_path_factory.mktemp("other")
    now = dt.datetime.now(dt.UTC)
    for place in (folder, other):
        write_roles(place, robots=("ippon",), hosts=("localhost", "127.0.0.1"), days=2, now=now)
    (folder / "stranger.json5").write_text(
        (other / "console.json5").read_text().replace(f"{other}/ca.pem", f"{folder}/ca.pem")
    )
    return folder


@pytest.fixture
def network(folder, free_endpoint, patient_links, monkeypatch):
    """A navigator's router with its requests, and a way to connect to it as somebody."""
    endpoint = free_endpoint.replace("tcp/", "tls/")
    opened = []

    def become(name):
        monkeypatch.setenv(PROFILE, str(folder / f"{name}.json5"))
        return endpoint

    def connect(name):
        opened.append(open_client(become(name), 20.0))
        return opened[-1]

    router = open_router(become("navigator"))
    stood = ControlReply(state="stopped")
    served = [
        serve(router, f"ippon/{keys.CONTROL}", ControlRequest, lambda _: stood),
        serve(router, f"ippon/{keys.FEEDBACK}", FeedbackRequest, lambda _: Accepted()),
    ]
    connect.router, connect.endpoint = router, endpoint
    yield connect
    for one in (*opened, router):
        one.close()
    del served


def control(asking):
    request = ControlRequest(action="stop")
    return ask(asking, "ippon/control", request, ControlReply, 20.0).state


def await_count(came, count, timeout_s=20.0):
    """Wait for messages: a reply comes with the priority of its question, and may overtake them."""
    deadline = time.monotonic() + timeout_s
    while len(came) < count:
        assert time.monotonic() < deadline, came
        time.sleep(0.01)


def test_a_console_watches_and_steers(network):
    console = network("console")
    heard = []
    subscribe(console, "ippon/status", heard.append)
    assert control(console) == "stopped"
    assert ask(console, "ippon/feedback", FeedbackRequest(verdict="confirm"), Accepted, 20.0)
    driven = []
    subscribe(network.router, "ippon/teleop/cmd_vel", driven.append)
    for _ in range(20):
        console.put("ippon/teleop/cmd_vel", b"go")
        time.sleep(0.05)
    network.router.put("ippon/status", b"fine")
    assert control(console) == "stopped"
    await_count(driven, 20)
    await_count(heard, 1)
    assert driven == 20 * [b"go"]
    assert heard == [b"fine"]


def test_a_requester_may_ask_and_stop_and_nothing_else(network):
    requester = network("requester")
    assert control(requester) == "stopped"
    with pytest.raises(LinkError, match="no reply on ippon/feedback"):
        ask(requester, "ippon/feedback", FeedbackRequest(verdict="confirm"), Accepted, 0.5)
    heard = []
    subscribe(network.router, "ippon/**", heard.append)
    requester.put("ippon/teleop/cmd_vel", b"go")
    requester.put("ippon/cmd_vel", b"go")
    requester.put("ippon/camera/color/image_raw/compressed", b"a false picture")
    assert control(requester) == "stopped"
    assert b"go" not in heard
    assert b"a false picture" not in heard


def test_a_robot_sends_and_obeys_and_commands_nothing(network):
    robot = network("robot")
    heard, obeyed = [], []
    subscribe(network.router, "ippon/camera/**", heard.append)
    subscribe(robot, "ippon/cmd_vel", obeyed.append)
    console = network("console")
    for _ in range(20):
        # The first message goes out before the client knows whether anybody listens.
        robot.put("ippon/camera/color/image_raw/compressed", b"a picture")
        time.sleep(0.05)
    with pytest.raises(LinkError, match="no reply on ippon/control"):
        ask(robot, "ippon/control", ControlRequest(action="resume"), ControlReply, 0.5)
    key = "ippon/segmentation/labels"
    kept = network.router.declare_queryable(key, lambda query: query.reply(key, b"hat"))
    assert last_message(robot, key, 5.0) == b"hat", "a robot that starts later gets them, too"
    network.router.put("ippon/cmd_vel", b"forward")
    assert control(console) == "stopped"
    with pytest.raises(LinkError):
        ask(robot, "ippon/search", ControlRequest(action="stop"), ControlReply, 0.5)
    await_count(heard, 20)
    await_count(obeyed, 1)
    assert heard == 20 * [b"a picture"]
    assert obeyed == [b"forward"]
    del kept


def test_a_bridge_sees_the_navigator_and_other_bridges(network):
    robot, second = network("robot"), network("robot")
    token = robot.liveliness().declare_token("ippon/alive/ros2/1-robot-7")
    alive = network.router.liveliness().declare_token("ippon/alive/navigator")
    assert is_alive(robot, "ippon/alive/navigator", 5.0)
    assert is_alive(second, "ippon/alive/ros2/*", 5.0)
    deadline, found = time.monotonic() + 10.0, []
    while not found and time.monotonic() < deadline:
        # A single question may find nothing on a busy machine.
        found = [str(one.ok.key_expr) for one in second.liveliness().get("ippon/alive/ros2/*")]
    assert found == ["ippon/alive/ros2/1-robot-7"]
    heard = []
    subscribe(network.router, "ippon/tf_static", heard.append, kept=True)
    robot.put("ippon/odom", b"pose")
    del token, alive


@pytest.mark.parametrize("role", ["robot", "console", "recorder"])
def test_a_bridge_that_may_not_send_says_so(network, caplog, monkeypatch, role):
    monkeypatch.setattr(zenoh_side, "REFUSED_AFTER_S", 10.0 if role == "robot" else 0.5)
    token = zenoh_side.claim(network(role), "ippon", network(role))
    assert ("access rules refuse what this bridge sends" in caplog.text) == (role != "robot")
    del token


def test_a_recorder_commands_nothing(network):
    recorder = network("recorder")
    with pytest.raises(LinkError, match="no reply on ippon/control"):
        ask(recorder, "ippon/control", ControlRequest(action="stop"), ControlReply, 0.5)


@pytest.fixture
def recorder(network, monkeypatch, folder, tmp_path):
    """A recorder with its certificate, which has been heard by the router."""
    monkeypatch.setenv(PROFILE, str(folder / "recorder.json5"))
    config = RecorderConfig(
        connect=network.endpoint, root=tmp_path / "sessions", wait=True,
        limits=RecordingLimits(min_free_gb=0.0),
    )  # fmt: skip
    stop, statuses = threading.Event(), queue.Queue()
    subscribe(network.router, f"ippon/{keys.RECORDING}", statuses.put)
    thread = threading.Thread(target=Recorder(config).run, args=(stop,))
    thread.start()
    yield statuses
    stop.set()
    thread.join()


def test_a_recorder_answers_the_console_and_says_what_failed(network, recorder, tmp_path):
    console = network("console")
    heard, events = queue.Queue(), queue.Queue()
    subscribe(console, f"ippon/{keys.RECORDING}", heard.put)
    subscribe(console, f"ippon/{keys.EVENT}", events.put)
    exchanges = queue.Queue()
    subscribe(network.router, f"ippon/{keys.RECORD}/{keys.EXCHANGE}", exchanges.put)
    assert msgspec.json.decode(recorder.get(timeout=10.0))["state"] == "off"
    assert msgspec.json.decode(heard.get(timeout=10.0))["state"] == "off"

    def act(action, text=""):
        request = RecordRequest(action=action, text=text)
        return ask(console, f"ippon/{keys.RECORD}", request, RecordingStatus, 5.0)

    assert act("start").state == "recording"
    now = last_message(console, f"ippon/{keys.RECORDING}", 5.0)
    assert msgspec.json.decode(now)["state"] == "recording"
    assert b"start" in exchanges.get(timeout=10.0), "recorded by others"
    act("note", "the lamp was moved")
    assert act("stop").state == "off"
    (tmp_path / "sessions").rename(tmp_path / "elsewhere")
    (tmp_path / "sessions").write_text("a file in the place of the folder")
    assert act("start").state == "failed"
    event = msgspec.json.decode(events.get(timeout=10.0))
    assert (event["kind"], event["text"][:29]) == ("error", "a recording cannot be written")


def test_a_console_hears_nothing_in_the_recorders_name_from_others(network):
    for role in ("requester", "robot"):
        session, heard = network(role), []
        subscribe(network.router, f"ippon/{keys.RECORDING}", heard.append)
        for _ in range(5):
            session.put(f"ippon/{keys.RECORDING}", b"full")
            time.sleep(0.05)
        with pytest.raises(LinkError):
            ask(session, "ippon/search", ControlRequest(action="stop"), ControlReply, 0.5)
        assert heard == []


def test_a_replay_says_that_it_has_ended(network):
    robot, heard = network("robot"), queue.Queue()
    subscribe(network.router, f"ippon/{keys.ENDED}", heard.put)
    # What is sent before the subscription has come through is lost.
    deadline = time.monotonic() + 30.0
    while heard.empty() and time.monotonic() < deadline:
        robot.put(f"ippon/{keys.ENDED}", b"the replay has ended")
        time.sleep(0.05)
    assert heard.get(timeout=1.0) == b"the replay has ended"


@pytest.mark.parametrize("topic", keys.KEPT)
def test_what_a_robot_sent_once_reaches_every_role_that_comes_late(network, topic):
    put = stream_publisher(network("robot"), f"ippon/{topic}", kept=True)
    put(b"once")
    for role in ("console", "requester", "recorder", "navigator"):
        heard = queue.Queue()
        subscribe(network(role), f"ippon/{topic}", heard.put, kept=True)
        assert heard.get(timeout=10.0) == b"once", role


REFUSED = "A refused TLS certificate looks the same"


def test_a_certificate_of_another_authority_does_not_get_in(network):
    with pytest.raises(LinkError, match=REFUSED):
        network("stranger")


def test_who_has_no_certificate_does_not_get_in(network, monkeypatch):
    monkeypatch.delenv(PROFILE)
    with pytest.raises(LinkError, match=REFUSED):
        open_client(network.endpoint, 1.0)


def test_a_profile_that_is_none_is_named(tmp_path, monkeypatch, free_endpoint):
    path = tmp_path / "none.json5"
    monkeypatch.setenv(PROFILE, str(path))
    with pytest.raises(LinkError, match=r"IPPON_ZENOH_PROFILE names .*none.json5"):
        open_router(free_endpoint)
    path.write_text("{ transport: 3 }")
    with pytest.raises(LinkError, match="not a zenoh configuration"):
        open_router(free_endpoint)
