"""The login as a hostile client meets it, on real sockets."""

import re
import resource
import socket
import ssl
import time
from urllib.parse import quote, urlsplit

import httpx2
import msgspec
import pytest
import trustme
from viser import __version__ as viser_version
from websockets.exceptions import ConnectionClosed, InvalidStatus

from app.links.network.inbox import Inbox
from app.messages.lease import LeaseStatus
from app.nodes.console.link.navigator_link import NavigatorLink
from app.nodes.console.scene.state_feed import StateFeed
from app.nodes.console.web import connections, throttle
from app.nodes.console.web.access import COOKIE, LoginAccess
from app.nodes.console.web.accounts import add_account, load_accounts
from app.nodes.console.web.gateway import Gateway
from app.nodes.console.web.guard import Hosts
from app.nodes.console.web.login import LoginPages
from app.nodes.console.web.throttle import FREE
from app.view.words import ENGLISH

PASSWORDS = {"anna": "correct horse", "vera": "battery staple", "sue": "trombone shop"}
ROLES = {"anna": "operator", "vera": "viewer", "sue": "supervisor"}
PROTOCOL = f"viser-v{viser_version}"


@pytest.fixture(scope="module")
def accounts(tmp_path_factory):
    path = tmp_path_factory.mktemp("console") / "users"
    for name, password in PASSWORDS.items():
        add_account(path, name, password, ROLES[name])
    return load_accounts(path)


@pytest.fixture
def link():
    """A link whose navigator is not there."""
    return NavigatorLink("tcp/127.0.0.1:1", "r", [], Inbox([]), print)


@pytest.fixture
def gateway(viser_server, browsers, accounts, link):
    """A console with logins."""
    state_feed = StateFeed()
    state_feed.post(b'{"type":"state","link":"live"}')
    access = LoginAccess(browsers, is_secure=False)
    login = LoginPages(access, accounts)
    return Gateway(viser_server, state_feed, link, access, Hosts("127.0.0.1"), login)


@pytest.fixture
def client(stage, gateway):
    """A stranger's requests."""
    served = stage.Served(gateway)
    yield served
    served.close()


@pytest.fixture
def encrypted(stage, gateway):
    """A stranger's requests over TLS."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    trustme.CA().issue_cert("127.0.0.1").configure_cert(context)
    served = stage.Served(gateway, tls=context)
    yield served
    served.close()


def form_of(client):
    return re.search(r'name="form" value="([^"]+)"', client.get("/login").text)[1]


def post(client, name, password, form=None):
    data = {"form": form or form_of(client), "name": name, "password": password}
    return client.post("/login", data=data)


def log_in(client, name):
    """Log in; return the cookie."""
    answer = post(client, name, PASSWORDS[name])
    assert (answer.status_code, answer.headers["location"]) == (303, "/")
    return f"{name_of(client)}={client.http.cookies[name_of(client)]}"


def name_of(client):
    """Return the name of a login's cookie."""
    return f"{COOKIE}-{urlsplit(client.origin).port}"


@pytest.mark.parametrize(
    "path", ["/assets/shell.js", "/view/", "/view", "/health", "/nothing", "/login/x", "/Login"]
)
def test_a_stranger_sees_nothing_but_the_form(client, path):
    assert client.get(path).status_code == 401
    page = client.get("/")
    assert (page.status_code, page.headers["location"]) == (303, "/login")
    form = client.get("/login")
    assert form.status_code == 200
    assert "form-action 'self'" in form.headers["content-security-policy"]
    assert "<script" not in form.text
    assert client.get("/assets/login.css").status_code == 200


@pytest.mark.parametrize(
    ("page", "after"),
    [
        ("/robot/site~b/", "/robot/site~b/"),
        ("/robot/site~b", "/robot/site~b"),
        ("/", "/"),
        ("//evil.example/", "/"),
        ("https://evil.example/robot/b/", "/"),
        ("/robot/b/assets/shell.js", "/"),
        ('/robot/b/"><script>', "/"),
    ],
)
def test_after_the_login_comes_the_page_of_the_robot_that_it_was_for(client, page, after):
    address = f"/login?to={quote(page)}"
    form = client.get(address).text
    action = re.search(r'action="([^"]+)"', form)[1]
    assert action == (f"/login?to={after}" if after != "/" else "/login")
    data = {"form": re.search(r'name="form" value="([^"]+)"', form)[1], "name": "anna"}
    again = client.post(action, data=data | {"password": "wrong"}).text
    assert re.search(r'action="([^"]+)"', again)[1] == action
    data["form"] = re.search(r'name="form" value="([^"]+)"', again)[1]
    answer = client.post(action, data=data | {"password": PASSWORDS["anna"]})
    assert (answer.status_code, answer.headers["location"]) == (303, after)


def test_the_page_of_a_robot_asks_for_a_login_that_leads_back_to_it(client):
    answer = client.get("/robot/site~b/")
    assert (answer.status_code, answer.headers["location"]) == (303, "/login?to=/robot/site~b/")


@pytest.mark.parametrize("value", [None, "forged", "a" * 3000])
@pytest.mark.parametrize("path", ["/api/ws", "/view"])
def test_a_websocket_without_a_pass_is_refused(client, path, value):
    cookie = None if value is None else f"{name_of(client)}={value}"
    with pytest.raises(InvalidStatus) as refused:
        client.socket(path, cookie=cookie)
    assert refused.value.response.status_code == 403
    assert client.post("/api/stop", headers={"Cookie": cookie or ""}).status_code == 401


def test_the_password_opens_everything_and_the_cookie_is_hidden(client):
    answer = post(client, "anna", PASSWORDS["anna"])
    ours = f"{name_of(client)}="
    cookie = next(c for c in answer.headers.get_list("set-cookie") if c.startswith(ours))
    for part in ("HttpOnly", "SameSite=strict", "Path=/", "Max-Age=43200"):
        assert part in cookie
    assert client.get("/").status_code == 200
    assert client.get("/view/").status_code == 200
    assert client.get("/login").status_code == 303
    cookie = cookie.split(";")[0]
    with client.socket("/api/ws", cookie=cookie) as shell:
        you = msgspec.json.decode(next(m for m in shell if "you" in m))
    assert (you["name"], you["role"], you["has_login"]) == ("anna", "operator", True)


@pytest.mark.parametrize(
    ("name", "password"),
    [("anna", "wrong one"), ("nobody", "correct horse"), ("anna\n", "x"), ("<b>", "x" * 2000)],
)
def test_a_wrong_password_is_refused_and_says_nothing_more(client, name, password):
    answer = post(client, name, password)
    assert answer.status_code == 401
    assert ENGLISH("login.wrong") in answer.text
    assert "<b>" not in answer.text
    assert name_of(client) not in client.http.cookies


@pytest.mark.parametrize(("proxy", "status"), [(None, 429), ("127.0.0.1", 303)])
def test_behind_a_proxy_that_is_named_nobody_waits_for_the_guesses_of_others(
    stage, gateway, monkeypatch, proxy, status
):
    monkeypatch.setattr(throttle, "FREE", 1)
    monkeypatch.setattr(throttle, "FIRST_WAIT_S", 60.0)
    client = stage.Served(gateway, proxy=proxy)
    try:
        # What a browser says of itself comes before what the proxy has added.
        client.http.headers["X-Forwarded-For"] = "10.0.0.7, 10.0.0.6"
        assert post(client, "anna", "wrong one").status_code == 401
        client.http.headers["X-Forwarded-For"] = "10.0.0.8, 10.0.0.6"
        assert post(client, "anna", PASSWORDS["anna"]).status_code == 429
        client.http.headers["X-Forwarded-For"] = "10.0.0.7"
        assert post(client, "anna", PASSWORDS["anna"]).status_code == status
    finally:
        client.close()


@pytest.mark.slow
def test_guessing_is_slowed_down(client, monkeypatch):
    monkeypatch.setattr(throttle, "FIRST_WAIT_S", 60.0)
    for _ in range(FREE):
        assert post(client, "anna", "wrong one").status_code == 401
    answer = post(client, "anna", PASSWORDS["anna"])
    assert answer.status_code == 429
    assert "Too many wrong passwords. Try again in" in answer.text
    assert int(answer.headers["retry-after"]) >= 1
    log_in(client, "vera")


@pytest.mark.parametrize("form", ["", "guess", "é"])
def test_a_form_that_we_did_not_serve_is_refused(client, form):
    data = {"form": form, "name": "anna", "password": PASSWORDS["anna"]}
    answer = client.post("/login", data=data)
    assert answer.status_code == 403
    assert ENGLISH("login.stale") in answer.text
    form_of(client)
    assert client.post("/login", data=data).status_code == 403


def test_a_form_of_another_site_is_refused(client):
    form = form_of(client)
    data = {"form": form, "name": "anna", "password": PASSWORDS["anna"]}
    answer = client.post("/login", data=data, headers={"Origin": "http://evil.example"})
    assert answer.status_code == 403
    assert name_of(client) not in client.http.cookies


@pytest.mark.parametrize("body", [b"", b"\xff\xfe", b"x" * 10_000, b"name=anna", b"a=1&" * 20])
def test_what_is_no_form_is_refused(client, body):
    answer = client.post("/login", content=body)
    assert (answer.status_code, answer.text) == (400, "a form of name and password was expected\n")


def test_after_a_logout_the_pass_is_worth_nothing(client):
    cookie = log_in(client, "anna")
    other = httpx2.Client(
        base_url=client.origin, headers={"Cookie": cookie}, verify=False, timeout=60.0
    )
    assert other.get("/health").status_code == 200
    with client.socket("/api/ws", cookie=cookie) as shell:
        shell.recv(timeout=10)
        scene = client.socket("/view", cookie=cookie, subprotocols=[PROTOCOL])
        scene.recv(timeout=10)
        answer = client.post("/logout")
        assert (answer.status_code, answer.headers["location"]) == (303, "/login")
        for open_one in (shell, scene):
            with pytest.raises(ConnectionClosed):
                drain(open_one)
    assert other.get("/health").status_code == 401
    with pytest.raises(InvalidStatus):
        client.socket("/api/ws", cookie=cookie)
    other.close()


def drain(open_one):
    while True:
        open_one.recv(timeout=10)


def test_another_site_cannot_log_anyone_out(client):
    log_in(client, "anna")
    assert client.post("/logout", headers={"Origin": "http://evil.example"}).status_code == 403
    assert client.get("/health").status_code == 200


def test_a_viewers_clicks_and_commands_do_nothing(client, viser_server, link):
    cookie = log_in(client, "vera")
    box = viser_server.server.gui.add_checkbox("box", initial_value=False)
    click = msgspec.msgpack.encode(
        {"type": "GuiUpdateMessage", "uuid": box._impl.uuid, "updates": {"value": True}}
    )
    with client.socket("/view", cookie=cookie, subprotocols=[PROTOCOL]) as scene:
        scene.recv(timeout=10)
        scene.send(click)
        time.sleep(0.5)
        assert box.value is False
    with client.socket("/api/ws", cookie=cookie) as shell:
        for number, message in enumerate(
            ['"control","action":"pause"', '"drive","mode":"manual"', '"lease","action":"request"']
        ):
            shell.send(f'{{"type":{message},"id":{number}}}')
            reply = msgspec.json.decode(next(m for m in shell if '"reply"' in m))
            assert (
                reply["text"]
                == "your login (viewer) can watch and stop the robot, but not command it"
            )
    with client.socket("/view", cookie=log_in_again(client, "anna"), subprotocols=[PROTOCOL]) as s:
        s.recv(timeout=10)
        link.lease_status = LeaseStatus(state="held", holder="Bert", epoch=4)
        s.send(click)
        time.sleep(0.5)
        assert box.value is False, "an operator while another has control"
        link.lease_status = LeaseStatus()
        s.send(click)
        deadline = time.monotonic() + 10.0
        while not box.value:
            assert time.monotonic() < deadline
            time.sleep(0.02)
    box.remove()


def log_in_again(client, name):
    client.post("/logout")
    return log_in(client, name)


def test_taking_over_is_for_supervisors(client):
    for name, text in [
        ("anna", "your login (operator) cannot take control: request it instead"),
        ("sue", "no navigator at tcp/127.0.0.1:1"),
    ]:
        with client.socket("/api/ws", cookie=log_in_again(client, name)) as shell:
            shell.send('{"type":"lease","id":1,"action":"take"}')
            reply = msgspec.json.decode(next(m for m in shell if '"reply"' in m))
            assert reply["text"] == text


@pytest.fixture
def many_files():
    """Both ends of a thousand connections are files of this process."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = 4096 if hard == resource.RLIM_INFINITY else min(4096, hard)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, wanted), hard))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def raw(client):
    return socket.create_connection(("127.0.0.1", client.port), timeout=10.0)


def test_a_thousand_connections_keep_nobody_out(client, many_files):
    with client.socket("/api/ws", cookie=log_in(client, "anna")) as shell:
        shell.recv(timeout=10)
        flood = [raw(client) for _ in range(1000)]
        try:
            assert httpx2.get(f"{client.origin}/login", timeout=10.0).status_code == 200
            assert client.get("/health").status_code == 200
            shell.send('{"type":"ping","t":1}')
            assert any('"pong"' in message for message in shell)
            dropped = 0
            for one in flood:
                one.settimeout(0.0)
                try:
                    dropped += one.recv(1) == b""
                except ConnectionError:
                    dropped += 1
                except BlockingIOError:
                    pass
            assert dropped >= 1000 - connections.MAX_IDLE
        finally:
            for one in flood:
                one.close()


def test_silent_connections_keep_nobody_out_over_tls(encrypted, monkeypatch):
    monkeypatch.setattr(connections, "MAX_IDLE", 20)
    monkeypatch.setattr(connections, "REQUEST_S", 60.0)
    flood = [raw(encrypted) for _ in range(60)]
    try:
        assert encrypted.get("/login").headers["strict-transport-security"]
        for one in flood[:40]:
            assert one.recv(1) == b""
        flood[-1].settimeout(0.0)
        with pytest.raises(BlockingIOError):
            flood[-1].recv(1)
    finally:
        for one in flood:
            one.close()


def test_a_tls_handshake_that_never_ends_is_dropped(encrypted, monkeypatch):
    monkeypatch.setattr(connections, "REQUEST_S", 0.3)
    with raw(encrypted) as one:
        one.sendall(b"\x16\x03\x01")
        assert one.recv(1) == b""


def test_a_request_that_comes_with_the_end_of_the_handshake_is_answered(encrypted):
    context = ssl._create_unverified_context()
    incoming, outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
    tls = context.wrap_bio(incoming, outgoing)
    with raw(encrypted) as one:
        while True:
            try:
                tls.do_handshake()
                break
            except ssl.SSLWantReadError:
                one.sendall(outgoing.read())
                incoming.write(one.recv(65_536))
        tls.write(b"GET /login HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        one.sendall(outgoing.read())
        while True:
            incoming.write(one.recv(65_536))
            try:
                assert tls.read().startswith(b"HTTP/1.1 200")
                break
            except ssl.SSLWantReadError:
                pass


def test_a_connection_counts_again_once_its_request_is_answered(client, monkeypatch):
    monkeypatch.setattr(connections, "MAX_IDLE", 2)
    with raw(client) as asked, raw(client) as silent:
        head = f"POST /login HTTP/1.1\r\nHost: {client.host}\r\nOrigin: {client.origin}\r\n"
        asked.sendall(f"{head}Content-Length: 1\r\nExpect: 100-continue\r\n\r\n".encode())
        assert asked.recv(1000).startswith(b"HTTP/1.1 100 ")
        with raw(client), raw(client):
            assert silent.recv(1) == b"", "the oldest one that waits for nothing"
            asked.sendall(b"x")
            assert asked.recv(1000).startswith(b"HTTP/1.1 400 ")
            with raw(client):
                while asked.recv(1000):
                    pass


def test_a_request_that_never_ends_is_dropped(client, monkeypatch):
    monkeypatch.setattr(connections, "REQUEST_S", 0.3)
    with raw(client) as one:
        one.sendall(b"GET / HTTP/1.1\r\nHost: ")
        assert one.recv(1) == b""


def fill(one):
    for _ in range(10_000):
        one.sendall(b"X-Filler: " + b"x" * 1000 + b"\r\n")


def test_an_endless_head_is_refused(client):
    with raw(client) as one:
        one.sendall(b"GET / HTTP/1.1\r\n")
        with pytest.raises(ConnectionError):
            fill(one)
    assert client.get("/login").status_code == 200
