"""The zenoh profiles of docs/guides/security.md, with certificates made for the test."""

import pytest
import trustme

from app.links.network.requests import ask, serve
from app.links.network.session import PROFILE, LinkError, open_client, open_router
from app.links.network.subscription import subscribe
from app.messages import keys
from app.messages.control import Accepted, ControlReply, ControlRequest, FeedbackRequest
from tests.locations import ROOT

PROFILES = ROOT / "docs" / "security"
NAMES = ("navigator", "robot", "console", "requester", "stranger")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Certificates of one authority, one by a stranger's, and the profiles that name them."""
    folder = tmp_path_factory.mktemp("tls")
    authority, other = trustme.CA(), trustme.CA()
    authority.cert_pem.write_to_path(str(folder / "ca.pem"))
    for name in NAMES:
        issuer = other if name == "stranger" else authority
        issued = issuer.issue_cert("localhost", "127.0.0.1", common_name=name)
        issued.private_key_pem.write_to_path(str(folder / f"{name}.key"))
        issued.cert_chain_pems[0].write_to_path(str(folder / f"{name}.pem"))
    for name in NAMES:
        source = "navigator" if name == "navigator" else "client"
        text = (PROFILES / f"{source}.json5").read_text()
        text = text.replace("/etc/ippon/tls/client", str(folder / name))
        (folder / f"{name}.json5").write_text(text.replace("/etc/ippon/tls", str(folder)))
    return folder


@pytest.fixture
def network(folder, free_endpoint, monkeypatch):
    """A navigator's router with its requests, and a way to connect to it as somebody."""
    endpoint = free_endpoint.replace("tcp/", "tls/")
    opened = []

    def become(name):
        monkeypatch.setenv(PROFILE, str(folder / f"{name}.json5"))
        return endpoint

    def connect(name):
        opened.append(open_client(become(name), 3.0))
        return opened[-1]

    router = open_router(become("navigator"))
    stood = ControlReply(state="stopped")
    served = [
        serve(router, f"ippon/{keys.CONTROL}", ControlRequest, lambda _: stood),
        serve(router, f"ippon/{keys.FEEDBACK}", FeedbackRequest, lambda _: Accepted()),
    ]
    connect.router, connect.endpoint = router, endpoint
    yield connect
    for session in (*opened, router):
        session.close()
    del served


def control(session):
    request = ControlRequest(action="stop")
    return ask(session, "ippon/control", request, ControlReply, 2.0).state


def test_a_console_watches_and_steers(network):
    console = network("console")
    heard = []
    subscribe(console, "ippon/status", heard.append)
    assert control(console) == "stopped"
    assert ask(console, "ippon/feedback", FeedbackRequest(verdict="confirm"), Accepted, 2.0)
    network.router.put("ippon/status", b"fine")
    assert control(console) == "stopped", "sent after the status, so that it has come by now"
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
    robot.put("ippon/camera/color/image_raw/compressed", b"a picture")
    with pytest.raises(LinkError, match="no reply on ippon/control"):
        ask(robot, "ippon/control", ControlRequest(action="resume"), ControlReply, 0.5)
    network.router.put("ippon/cmd_vel", b"forward")
    assert control(console) == "stopped"
    with pytest.raises(LinkError):
        ask(robot, "ippon/search", ControlRequest(action="stop"), ControlReply, 0.5)
    assert heard == [b"a picture"]
    assert obeyed == [b"forward"]


REFUSED = "a certificate that is refused looks the same"


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
    with pytest.raises(LinkError, match="no zenoh configuration"):
        open_router(free_endpoint)
