"""`ippon user` and `ippon console --users --tls-cert`, as typed."""

import io
import re
import ssl

import httpx2
import pytest
import trustme
import websockets.sync.client

from app.cli.main import run
from tests.ports import free_port

PASSWORD = "correct horse"


@pytest.fixture
def users(tmp_path, monkeypatch, capsys):
    path = tmp_path / "users"
    monkeypatch.setattr("sys.stdin", io.StringIO(f"{PASSWORD}\n"))
    assert run(["user", "anna", "--users", str(path), "--role", "supervisor"]) == 0
    assert capsys.readouterr().out == f"anna (supervisor) added in {path}\n"
    return path


def test_a_password_that_is_too_short_is_refused(users, monkeypatch, capsys):
    before = users.read_text()
    monkeypatch.setattr("sys.stdin", io.StringIO("short\n"))
    assert run(["user", "bert", "--users", str(users)]) == 2
    assert "a password has 8 to 1024 characters; this one has 5" in capsys.readouterr().err
    assert users.read_text() == before


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--host", "0.0.0.0"], "the console requires a login: make a file of users"),
        (["--users", "/nowhere/users"], "make the file with: ippon user NAME --users /nowhere"),
        (["--tls-cert", "a.pem"], "both a certificate and its key: --tls-cert and --tls-key"),
        (["--tls-cert", "a.pem", "--tls-key", "b.pem"], "TLS cannot use the certificate a.pem"),
    ],
)
def test_a_console_that_would_not_be_safe_does_not_start(arguments, text, capsys):
    assert run(["console", "--port", "0", *arguments]) == 2
    assert text in capsys.readouterr().err


@pytest.mark.process
def test_login_over_tls(launch, users, tmp_path):
    authority = trustme.CA()
    issued = authority.issue_cert("127.0.0.1", "localhost")
    certificate, key = tmp_path / "cert.pem", tmp_path / "key.pem"
    issued.cert_chain_pems[0].write_to_path(str(certificate))
    issued.private_key_pem.write_to_path(str(key))
    port = free_port()
    console = launch(
        "console", "--connect", "tcp/127.0.0.1:1", "--port", str(port), "--users", str(users),
        "--tls-cert", str(certificate), "--tls-key", str(key),
    )  # fmt: skip
    console.wait_for_log(f"console at https://127.0.0.1:{port}")
    context = ssl.create_default_context()
    authority.configure_trust(context)
    url = f"https://127.0.0.1:{port}"
    with httpx2.Client(
        base_url=url, verify=context, headers={"Origin": url}, timeout=60.0
    ) as client:
        page = client.get("/login")
        assert page.headers["strict-transport-security"] == "max-age=31536000"
        form = re.search(r'name="form" value="([^"]+)"', page.text)[1]
        data = {"form": form, "name": "anna", "password": PASSWORD}
        answer = client.post("/login", data=data)
        assert answer.status_code == 303
        cookie = next(c for c in answer.headers.get_list("set-cookie") if "__Host-ippon" in c)
        assert "Secure" in cookie
        assert client.get("/").status_code == 200
        with websockets.sync.client.connect(
            f"wss://127.0.0.1:{port}/api/ws",
            ssl=context,
            origin=url,
            additional_headers={"Cookie": cookie.split(";")[0]},
        ) as shell:
            assert any('"you"' in message for message in shell)
    with pytest.raises(httpx2.TransportError):
        httpx2.get(f"http://127.0.0.1:{port}/login", timeout=60.0)
