"""viser's client as the installed version packs it."""

import re

import pytest
import zstandard

from app.nodes.console.web.viser_server import client_page
from app.view.drawing.viser_client import SQUARE_POINTS, PackingError, unpack_client

DIGITS = bytes(c for c in range(0x21, 0x7F) if chr(c) not in "\"&<>'`")

DEFAULTS = (
    b"`data:image/jpeg;base64,AAAA`,enableDefaultLights:!0,enableDefaultLightsShadows:!0;"
    b"var m=1,s=fetch(n).then(e=>e.arrayBuffer()).then(e=>t({wasmBinary:e}));function g(){}"
    b"n.type===`retry`?e!==null&&a():n.type===`close`?(e=null,t!==null&&t.close(),1):0;"
    b"t.messageQueue.length=0,t.firstMessageBatch=!0;"
    b"function q(e,t){let n=e.messageQueue,r=1}"
    b"t.current.requestRender=()=>{a.current=performance.now()+B,i()};"
    b"let e=setInterval(()=>i(),V);return()=>{clearInterval(e),t.current.requestRender=()=>{}},"
    b"qf(()=>{performance.now()<a.current&&i()});"
    b"function L(){let e=K(e=>e.setDpr),t=b.useRef({windowStart:-1/0,averages:[]});"
    b"return qf(()=>{let n=t.current,r=performance.now();e(r)}),null}"
    b"function o(s){let c=e.mutable.current;c.sendMessage!==null&&("
    b"i=s,n?(c.sendMessage(s),r=!1,n=!1):r=!0)}"
    b"({gl:{preserveDrawingBuffer:!0,x:1}});"
    b"P=s({},`\n  precision mediump float;\n\n  varying vec3 vPosition;\n"
    b"  varying vec3 vColor; // in the vertex shader\n  void main() {}\n   `,`"
    b"varying vec3 vPosition;\n  uniform float point_ball_norm;\n  void main() {\n"
    b"      #include <fog_fragment>\n  }\n   `);"
    b"o=b.useMemo(()=>{return e},[i.colors]);b.useEffect(()=>()=>o.dispose(),[o]);"
)
CHANGED = (
    b"null,enableDefaultLights:!1,enableDefaultLightsShadows:!1;"
    b"var m=1,s=null;function g(){}"
    b"n.type===`retry`?e!==null&&t?.readyState!==WebSocket.CONNECTING&&a()"
    b":n.type===`close`?(e=null,t!==null&&t.close(),1):0;"
    b"t.messageQueue.length=0,t.firstMessageBatch=!0,globalThis.ipponMapFirst.begin();"
    b"function q(e,t){t=globalThis.ipponMapFirst.sieve(t,e.messageQueue,held=>q(e,held));"
    b"let n=e.messageQueue,r=1}"
    b"t.current.requestRender=()=>ipponDrawRate.request(i,()=>t.current.drainMessageQueue?.());"
    b"let e=setInterval(()=>ipponDrawRate.beat(i),V);"
    b"return()=>{clearInterval(e),t.current.requestRender=()=>{}},"
    b"qf(()=>{globalThis.ipponDrawRate.drawn(i)});"
    b"function L(){let e=K(e=>e.setDpr),t=b.useRef({windowStart:-1/0,averages:[]});"
    b"return qf(()=>{return globalThis.ipponDrawRate.sharpen(e);"
    b"let n=t.current,r=performance.now();e(r)}),null}"
    b"function o(s){let c=e.mutable.current;c.sendMessage!==null&&("
    b"r&&i.uuid!==s.uuid&&c.sendMessage(i),i=s,n?(c.sendMessage(s),r=!1,n=!1):r=!0)}"
    b"({gl:{antialias:globalThis.ipponDrawRate.smooths(),preserveDrawingBuffer:!0,x:1}});"
    b"P=s({},`\n  precision mediump float;\n\n" + SQUARE_POINTS + b"`);"
    b"o=b.useMemo(()=>{return e},[i.colors.length>3||i.colors]);"
    b"b.useEffect(()=>()=>o.dispose(),[o]);"
)


def _written(content):
    """Write bytes as viser's build does: five digits for four bytes."""
    out = b""
    for first in range(0, len(content), 4):
        group = content[first : first + 4]
        value, length = int.from_bytes(group, "big"), len(group) + 1
        out += bytes(DIGITS[value // 88**n % 88] for n in reversed(range(length)))
    return out


@pytest.fixture(scope="module")
def page():
    return client_page().read_bytes()


@pytest.mark.slow
def test_the_installed_client_unpacks_to_files_that_its_page_names(page):
    client = unpack_client(page, "/assets/")
    script, style, decoder = client.files
    assert b"WebGLRenderer" in client.files[script]
    assert client.files[script].startswith(b"globalThis.__viserZstdWasm=await")
    assert f'fetch("/assets/{decoder}")'.encode() in client.files[script]
    assert b"data:image/jpeg" not in client.files[script], "our own surroundings only"
    assert client.files[script].count(b"globalThis.ipponMapFirst") == 2, "the map comes first"
    assert client.files[script].count(b"ipponDrawRate") == 5, "frames are spaced"
    assert b"point_ball_norm <" not in client.files[script], "points are squares"
    assert b".drainMessageQueue=" in client.files[script], "it is there to be called"
    assert client.files[script].count(b"?.readyState!==WebSocket.CONNECTING&&") == 1, "it may wait"
    assert b"mantine" in client.files[style]
    assert client.files[decoder].startswith(b"\0asm")
    assert f'src="/assets/{script}"'.encode() in client.page
    assert f'href="/assets/{style}"'.encode() in client.page
    assert b"data-p=" not in client.page
    assert not re.search(rb"<script[^>]*>[^<]", client.page), "nothing is left inline"
    assert b'<div id="root"></div>' in client.page
    assert script.encode() in client.links


@pytest.mark.parametrize("rest", range(4))
def test_every_length_is_read(page, rest):
    code = b"let a = 1;" + DEFAULTS + b" " * rest
    packed = _written(zstandard.ZstdCompressor().compress(b"p{}" + code))
    own = re.sub(
        rb'data-p="[^"]*" data-ss="\d+" data-cs="\d+"',
        lambda _: b'data-p="%s" data-ss="3" data-cs="%d"' % (packed, len(code)),
        page,
    )
    script, style, _ = unpack_client(own, "/x/").files.items()
    assert script[1].endswith(CHANGED + b" " * rest)
    assert style[1] == b"p{}"


@pytest.mark.parametrize(
    ("before", "after", "said"),
    [
        (b"<script data-p=", b"<script data-q=", "has no script"),
        (b'data-p="', b'data-p="~~~~~', "cannot be unpacked"),
        (b'data-p="', b'data-p="<', "1 that are none"),
        (b'data-ss="1', b'data-ss="', "unpacks to"),
    ],
)
def test_another_packing_is_refused(page, before, after, said):
    with pytest.raises(PackingError, match=said):
        unpack_client(page.replace(before, after, 1), "/assets/")
