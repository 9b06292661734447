"""What browsers are sent, and what they may keep."""

import gzip
import re

import pytest
from starlette.requests import Request

from app.nodes.console.web.assets import Assets


@pytest.fixture(scope="module")
def assets():
    return Assets()


def _answer(asset, accepted="gzip, deflate"):
    headers = [(b"accept-encoding", accepted.encode())]
    return asset.response(Request({"type": "http", "method": "GET", "headers": headers}))


def _program(assets):
    return re.search(rb'src="/assets/(viser-[0-9a-f]+\.js)"', _answer(assets.view, "").body)[1]


@pytest.mark.slow
def test_the_scenes_program_is_compressed_and_kept_by_the_browser(assets):
    asset = assets.files[_program(assets).decode()]
    answer, plain = _answer(asset), _answer(asset, "identity")
    assert answer.headers["content-encoding"] == "gzip"
    assert "immutable" in answer.headers["cache-control"]
    assert "content-encoding" not in plain.headers
    assert gzip.decompress(answer.body) == plain.body
    assert 3 * len(answer.body) < len(plain.body)


def test_the_shell_has_the_scenes_program_fetched_at_once(assets):
    shell = _answer(assets.shell, "")
    assert b'rel="modulepreload" href="/assets/%s"' % _program(assets) in shell.body
    assert shell.headers["cache-control"] == "no-store"


def test_our_own_files_are_asked_for_again(assets):
    assert _answer(assets.files["shell.js"]).headers["cache-control"] == "no-cache"
