import datetime as dt

import pytest

from app.certificates.roles import write_roles
from app.links.loopback import reachable
from app.links.network.session import (
    PROFILE,
    LinkError,
    is_open_to_all,
    open_client,
    open_robot_client,
    open_router,
)


def test_a_client_hears_a_router(free_endpoint):
    router = open_router(free_endpoint)
    client = open_client(free_endpoint)
    try:
        queryable = router.declare_queryable("a/b", lambda q: q.reply("a/b", b"here"))
        replies = [r.ok.payload.to_bytes() for r in client.get("a/b", timeout=5.0)]
        assert replies == [b"here"]
        queryable.undeclare()
    finally:
        client.close()
        router.close()


def test_nobody_at_the_endpoint(free_endpoint):
    with pytest.raises(LinkError, match=f"no navigator answers at {free_endpoint} within 0.3 s"):
        open_client(free_endpoint, timeout_s=0.3)


def test_the_endpoint_is_taken(free_endpoint):
    router = open_router(free_endpoint)
    try:
        with pytest.raises(LinkError, match=f"cannot listen on {free_endpoint}: another navigator"):
            open_router(free_endpoint)
    finally:
        router.close()


@pytest.mark.parametrize("endpoint", ["nonsense", "tcp/", "udp//:", "127.0.0.1:7447", ""])
def test_malformed_endpoints_are_a_link_error(endpoint):
    with pytest.raises(LinkError):
        open_client(endpoint, timeout_s=0.3)
    with pytest.raises(LinkError):
        open_router(endpoint)


def test_the_robots_own_network_has_a_configuration_of_its_own(free_endpoint, monkeypatch):
    monkeypatch.setenv("IPPON_ZENOH_PROFILE", "/nowhere/navigator.json5")
    with pytest.raises(LinkError, match=f"no router of the robot answers at {free_endpoint}"):
        open_robot_client(free_endpoint, 0.3)
    monkeypatch.setenv("IPPON_ZENOH_ROBOT_PROFILE", "/nowhere/robot.json5")
    with pytest.raises(LinkError, match="IPPON_ZENOH_ROBOT_PROFILE names"):
        open_robot_client(free_endpoint, 0.3)


@pytest.mark.parametrize(
    ("listen", "connect"),
    [
        ("tls/0.0.0.0:7447", "tls/127.0.0.1:7447"),
        ("tcp/[::]:7447", "tcp/127.0.0.1:7447"),
        ("tcp/0.0.0.0:7447#iface=lo", "tcp/127.0.0.1:7447#iface=lo"),
        ("tcp/10.0.0.0:7447", "tcp/10.0.0.0:7447"),
        ("tls/robot.local:7447", "tls/robot.local:7447"),
        ("unixsock-stream/tmp/x", "unixsock-stream/tmp/x"),
    ],
)
def test_where_an_endpoint_is_reached_from_the_same_machine(listen, connect):
    assert reachable(listen) == connect


@pytest.mark.parametrize("host", ["0.0.0.0", "[::]"])
def test_a_process_beside_the_router_reaches_it_with_certificates_for_other_hosts(
    host, free_endpoint, tmp_path, monkeypatch
):
    listen = f"tls/{host}:{free_endpoint.rpartition(':')[2]}"
    now = dt.datetime.now(dt.UTC)
    write_roles(tmp_path, robots=("ippon",), hosts=("robot.local",), days=1, now=now)
    monkeypatch.setenv(PROFILE, str(tmp_path / "navigator.json5"))
    router = open_router(listen)
    try:
        # What the navigator starts has the navigator's profile; `ippon ask` has one of its own.
        open_client(reachable(listen)).close()
        monkeypatch.setenv(PROFILE, str(tmp_path / "requester.json5"))
        open_client(reachable(listen)).close()
    finally:
        router.close()


@pytest.mark.parametrize(
    ("listen", "is_open"),
    [
        ("tcp/127.0.0.1:7447", False),
        ("tcp/[::1]:7447", False),
        ("tcp/localhost:7447", False),
        ("unixsock-stream/tmp/x", False),
        ("tcp/0.0.0.0:7447", True),
        ("tcp/[::]:7447", True),
        ("udp/192.168.1.20:7447", True),
        ("ws/robot.local:7447", True),
        ("tcp/0.0.0.0:7447#iface=eth0", True),
        ("tls/0.0.0.0:7447", True),
        ("tls/0.0.0.0:7447#enable_mtls=true", False),
    ],
)
def test_who_reaches_an_endpoint_without_a_certificate(monkeypatch, tmp_path, listen, is_open):
    assert is_open_to_all(listen) is is_open
    profile = tmp_path / "profile.json5"
    monkeypatch.setenv(PROFILE, str(profile))
    profile.write_text('{connect: {endpoints: ["tcp/robot-1.local:7447"]}}')
    assert is_open_to_all(listen) is is_open, "nothing is protected by joining another router"
    profile.write_text("{access_control: {enabled: true, default_permission: 'deny'}}")
    assert not is_open_to_all(listen), "the rules of the profile decide"
    profile.write_text("{transport: {auth: {usrpwd: {dictionary_file: '/etc/users'}}}}")
    assert not is_open_to_all(listen), "who connects has to log in"
    profile.write_text("{transport: {link: {tls: {enable_mtls: true}}}}")
    assert is_open_to_all(listen) is (is_open and not listen.startswith("tls/"))
