"""viser's client, unpacked into files that browsers can cache in compiled form.

viser's page is one HTML file whose script contains all other files as text in base 88, compressed
twice, so that browsers unpack and compile it at every load. The console unpacks it once at its
start. The format is that of viser 1.1; a test checks it against the installed version.
"""

import gzip
import hashlib
import re
from dataclasses import dataclass
from typing import Final

import numpy as np
import zstandard

_SCRIPT: Final = re.compile(
    rb'<script data-p="(?P<packed>[^"]*)" data-ss="(?P<style>\d+)" data-cs="(?P<code>\d+)">'
    rb'.*?const A="(?P<digits>(?:[^"\\]|\\.)*)".*?const gzWasm="(?P<wasm>(?:[^"\\]|\\.)*)"'
    rb".*?</script>",
    re.DOTALL,
)
SQUARE_POINTS: Final = rb"""  flat varying vec3 vColor;
  uniform float scale;
  uniform vec3 uniformColor;
  #include <fog_pars_vertex>
  void main() {
      #ifdef USE_COLOR
      vColor = color;
      #else
      vColor = uniformColor;
      #endif
      vec4 world_pos = modelViewMatrix * vec4(position, 1.0);
      gl_Position = projectionMatrix * world_pos;
      gl_PointSize = scale / -world_pos.z;
      #ifdef USE_FOG
        vFogDepth = -world_pos.z;
      #endif
  }
`,`
  flat varying vec3 vColor;
  #include <fog_pars_fragment>
  void main() {
      gl_FragColor = vec4(vColor, 1.0);
      #include <fog_fragment>
  }
"""
"""Vertex and fragment shader of points, which are squares of one colour in every cloud of ours."""
_CHANGES: Final = (
    # The client's default environment map, which the server always replaces: decoding this
    # picture takes a software renderer seconds.
    (re.compile(rb"`data:image/jpeg;base64,[A-Za-z0-9+/=]+`"), rb"null"),
    # Lights whose shadows require an additional shader compilation.
    (
        re.compile(rb"enableDefaultLights:!0,enableDefaultLightsShadows:!0"),
        rb"enableDefaultLights:!1,enableDefaultLightsShadows:!1",
    ),
    # The sorter of Gaussian splats, which no scene of ours has: it evaluates text as code at its
    # start, which the console's pages forbid, and each page began with an error.
    (
        re.compile(
            rb"\b(\w++)=fetch\(\w+\)\.then\(\w+=>\w+\.arrayBuffer\(\)\)"
            rb"\.then\(\w+=>\w+\(\{wasmBinary:\w+\}\)\)(?=;function )"
        ),
        rb"\1=null",
    ),
    # The retry every second gave up a connection that was still being made. Browsers delay those
    # by seconds after failures, and each that is given up is a failure: it could go on for long.
    (
        re.compile(
            rb"\b(\w++)\.type===`retry`\?(\w+)!==null&&(\w+)\(\)"
            rb"(?=:\1\.type===`close`\?\(\2=null,(\w+)!==null&&\4\.close\(\))"
        ),
        rb"\1.type===`retry`?\2!==null&&\4?.readyState!==WebSocket.CONNECTING&&\3()",
    ),
    # Of all that was entered within 50 ms, in whichever control, only the last was sent: a text was
    # lost if a button was pressed that soon.
    (
        re.compile(
            rb"(function \w+\((\w+)\)\{let (\w+)=\w+\.mutable\.current;\3\.sendMessage!==null&&\()"
            rb"(?=(\w+)=\2,\w+\?\(\3\.sendMessage\(\2\),(\w+)=!1,)"
        ),
        rb"\1\5&&\4.uuid!==\2.uuid&&\3.sendMessage(\4),",
    ),
    # Start of a connection, and start of a message batch: both call `map_first.js`.
    (
        re.compile(rb"\b(\w++)\.messageQueue\.length=0,\1\.firstMessageBatch=!0"),
        rb"\g<0>,globalThis.ipponMapFirst.begin()",
    ),
    (
        re.compile(rb"function (\w+)\((\w+),(\w+)\)\{(?=let \w+=\2\.messageQueue,)"),
        rb"\g<0>\3=globalThis.ipponMapFirst.sieve(\3,\2.messageQueue,held=>\1(\2,held));",
    ),
    # Request of a frame, frame of every second, and start of a frame: all call `draw_rate.js`.
    (
        re.compile(
            rb"\b(\w++\.current)\.requestRender=\(\)=>"
            rb"\{\w+\.current=performance\.now\(\)\+\w+,(\w+)\(\)\}"
        ),
        rb"\1.requestRender=()=>ipponDrawRate.request(\2,()=>\1.drainMessageQueue?.())",
    ),
    (
        re.compile(
            rb"(?<=setInterval\(\(\)=>)(\w+)\(\)(?=,\w+\);return\(\)=>\{clearInterval\(\w+\),\w+\.current\.)"
        ),
        rb"ipponDrawRate.beat(\1)",
    ),
    (
        re.compile(rb"\b(\w++\(\(\)=>\{)performance\.now\(\)<\w+\.current&&(\w+)\(\)(?=\}\))"),
        rb"\1globalThis.ipponDrawRate.drawn(\2)",
    ),
    # The monitor that lowers the resolution by frames per second: `draw_rate.js` decides instead.
    (
        re.compile(
            rb"(let (\w+)=\w+\(\w+=>\w+\.setDpr\),\w+=\w+\.useRef\(\{windowStart:[^;]*;"
            rb"return \w+\(\(\)=>\{)(?=let )"
        ),
        rb"\1return globalThis.ipponDrawRate.sharpen(\2);",
    ),
    (
        re.compile(rb"gl:\{(?=preserveDrawingBuffer:!0,)"),
        rb"gl:{antialias:globalThis.ipponDrawRate.smooths(),",
    ),
    # The shaders of points draw circles and gradients, too, which takes a software renderer twice
    # as long as squares.
    (
        re.compile(
            rb"  varying vec3 vPosition;\n  varying vec3 vColor; // in the vertex shader.*?"
            rb"uniform float point_ball_norm;.*?#include <fog_fragment>\n  \}\n   (?=`)",
            re.DOTALL,
        ),
        SQUARE_POINTS,
    ),
    # A point cloud with new colours had a new material, for which the shaders are compiled again.
    (
        re.compile(rb"\},\[(\w+)\.colors\]\)(?=;\w+\.useEffect\(\(\)=>\(\)=>\w+\.dispose)"),
        rb"},[\1.colors.length>3||\1.colors])",
    ),
)
"""Patterns in the client and their replacements.

One that begins with a name begins at its first letter and takes all of it: trying every part of
every name in two megabytes takes half a second.
"""
_BASE: Final = 88
_GROUP: Final = 5
"""Digits per four bytes."""


class PackingError(Exception):
    """The page does not have the format of viser 1.1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClientFiles:
    """viser's client as a page and its files."""

    page: bytes
    """HTML page that loads the files."""
    files: dict[str, bytes]
    """Content by name; names contain a hash, so that browsers may cache the files forever."""
    links: bytes
    """HTML tags that make the browser fetch the script before it opens the page."""


def unpack_client(page: bytes, prefix: str) -> ClientFiles:
    """Unpack viser's client.

    Args:
        page: The HTML file of viser.
        prefix: Path that the files will be served under, with a slash at its end.

    Raises:
        PackingError: Its format is unknown.
    """
    found = _SCRIPT.search(page)
    if found is None:
        raise PackingError("viser's page has no script in the format of viser 1.1")
    digits, style_size = _unescaped(found["digits"]), int(found["style"])
    size = style_size + int(found["code"])
    try:
        content = zstandard.ZstdDecompressor().decompress(_number(found["packed"], digits), size)
        wasm = gzip.decompress(_number(_unescaped(found["wasm"]), digits))
    except (zstandard.ZstdError, OSError, ValueError, EOFError) as error:
        raise PackingError(f"viser's page cannot be unpacked: {error}") from error
    if len(content) != size or not wasm.startswith(b"\0asm"):
        raise PackingError(f"viser's page unpacks to {len(content)} bytes and not {size}")
    decoder = _named("zstd", "wasm", wasm)
    publish = f'await WebAssembly.compileStreaming(fetch("{prefix}{decoder}"))'
    code = f"globalThis.__viserZstdWasm={publish};\n".encode() + _changed(content[style_size:])
    script, style = _named("viser", "js", code), _named("viser", "css", content[:style_size])
    loaded = (
        f'<link rel="stylesheet" href="{prefix}{style}">'
        f'<script type="module" src="{prefix}{script}"></script>'
    ).encode()
    links = f'<link rel="modulepreload" href="{prefix}{script}">'.encode()
    return ClientFiles(
        page=page[: found.start()] + loaded + page[found.end() :],
        files={script: code, style: content[:style_size], decoder: wasm},
        links=links,
    )


def _changed(code: bytes) -> bytes:
    """Remove the content shown before the first message, and hook in our scripts."""
    for written, instead in _CHANGES:
        code, count = written.subn(instead, code)
        if count != 1:
            raise PackingError(
                f"viser's client has {written.pattern[:40]!r} {count} times, not once"
            )
    return code


def _named(stem: str, ending: str, content: bytes) -> str:
    return f"{stem}-{hashlib.sha256(content).hexdigest()[:12]}.{ending}"


def _unescaped(text: bytes) -> bytes:
    return re.sub(rb"\\(.)", rb"\1", text, flags=re.DOTALL)


def _number(text: bytes, digits: bytes) -> bytes:
    """Decode groups of five digits to four bytes each; the last group may be shorter."""
    value_of = np.full(256, -1, np.int64)
    value_of[np.frombuffer(digits, np.uint8)] = np.arange(len(digits))
    values = value_of[np.frombuffer(text, np.uint8)]
    if len(digits) != _BASE or (values < 0).any():
        raise ValueError(f"{len(digits)} digits, and {np.count_nonzero(values < 0)} that are none")
    whole = len(values) - len(values) % _GROUP
    weights = _BASE ** np.arange(_GROUP - 1, -1, -1)
    groups = values[:whole].reshape(-1, _GROUP) @ weights
    rest = 0
    for value in values[whole:].tolist():
        rest = rest * _BASE + value
    tail = rest.to_bytes(max(len(values) - whole - 1, 0), "big")
    return groups.astype(">u4").tobytes() + tail
