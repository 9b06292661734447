"""Passes: signed, expiring, revocable."""

import base64
import json
import time

import pytest
from itsdangerous import URLSafeSerializer
from starlette.datastructures import Headers

from app.nodes.console.web.access import COOKIE, LOGIN_S, SECURE_COOKIE, LoginAccess, OpenAccess
from app.nodes.console.web.browsers import MAX_BROWSERS, Browsers


class Clock:
    now = 1000.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def access(clock):
    return LoginAccess(Browsers(), is_secure=False, clock=clock)


def carrying(value, name=COOKIE):
    return Headers({"cookie": f"other=1; {name}={value}"})


def test_a_pass_lets_its_owner_in(access):
    browser = access.browser_of(carrying(access.issue("anna", "operator").value))
    assert (browser.name, browser.role, browser.expires_s) == ("anna", "operator", 1000.0 + LOGIN_S)
    assert len(browser.session) >= 32


def test_every_login_is_a_browser_of_its_own(access):
    one, two = (access.browser_of(carrying(access.issue("anna", "viewer").value)) for _ in "12")
    assert one is not two
    assert one.session != two.session


def test_a_login_does_not_depend_on_the_time_of_day():
    access = LoginAccess(Browsers(), is_secure=False)
    browser = access.browser_of(carrying(access.issue("anna", "operator").value))
    assert browser.expires_s == pytest.approx(time.monotonic() + LOGIN_S, abs=60.0)


def test_a_pass_expires(access, clock):
    headers = carrying(access.issue("anna", "operator").value)
    clock.now += LOGIN_S - 1.0
    assert access.browser_of(headers) is not None
    clock.now += 2.0
    assert access.browser_of(headers) is None


def test_a_revoked_pass_is_worth_nothing(access, clock):
    headers = carrying(access.issue("anna", "operator").value)
    access.revoke(access.browser_of(headers))
    assert access.browser_of(headers) is None
    clock.now += LOGIN_S + 1.0
    other = access.browser_of(carrying(access.issue("bert", "operator").value))
    access.revoke(other)
    assert access.browser_of(headers) is None, "forgotten as revoked, but expired by then"


def forged(access):
    value = access.issue("anna", "viewer").value
    body, signature = value.rsplit(".", 1)
    content = json.loads(base64.urlsafe_b64decode(body + "=" * (-len(body) % 4)))
    raised = json.dumps({**content, "role": "supervisor"}, separators=(",", ":")).encode()
    return base64.urlsafe_b64encode(raised).decode().rstrip("=") + "." + signature


@pytest.mark.parametrize(
    "value",
    ["", "x", "a.b", '"', "é", "." * 4000,
     URLSafeSerializer(b"guess", salt="ippon console login").dumps({"name": "anna"})],
)  # fmt: skip
def test_what_is_no_pass_is_worth_nothing(access, value):
    assert access.browser_of(carrying(value)) is None


def test_a_role_cannot_be_raised(access):
    assert access.browser_of(carrying(forged(access))) is None


def test_a_pass_of_another_console_is_worth_nothing(access, clock):
    other = LoginAccess(Browsers(), is_secure=False, clock=clock)
    assert access.browser_of(carrying(other.issue("anna", "operator").value)) is None


def test_consoles_at_two_ports_of_a_host_keep_their_own_logins(access):
    one = access.issue("anna", "operator").value
    jar = "bad name=1; ippon-8080=of another console; ippon-8081=" + one + "; ippon=of a third"
    assert access.browser_of(Headers({"host": "robots.lan:8081", "cookie": jar})).name == "anna"
    for host in ("robots.lan:8080", "robots.lan", "[::1]:8080", "robots.lan:x"):
        assert access.browser_of(Headers({"host": host, "cookie": jar})) is None


def test_over_tls_the_cookie_is_bound_to_the_host(clock):
    access = LoginAccess(Browsers(), is_secure=True, clock=clock)
    granted = access.issue("anna", "operator")
    assert (granted.cookie, granted.is_secure) == (SECURE_COOKIE, True)
    assert access.browser_of(carrying(granted.value)) is None
    assert access.browser_of(carrying(granted.value, SECURE_COOKIE)) is not None


def test_without_a_login_a_browser_is_known_by_its_cookie():
    access = OpenAccess(Browsers())
    browser = access.new_browser()
    assert access.browser_of(carrying(browser.session)) is browser
    assert browser.name == "browser 1"
    for value in ("", "short", "x" * 65, "no/slash" * 4):
        assert access.browser_of(carrying(value)) is None


def test_only_so_many_browsers_are_remembered():
    browsers = Browsers()
    first = browsers.get_or_add("first" * 5)
    for number in range(MAX_BROWSERS):
        browsers.get_or_add(f"{number:020d}")
    assert browsers.find(first.session) is None
    assert browsers.find(f"{MAX_BROWSERS - 1:020d}") is not None
