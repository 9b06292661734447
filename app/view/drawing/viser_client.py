"""viser's client, unpacked: the browser gets plain files that it can keep compiled.

viser ships one page whose script carries everything else as text, 88 characters a digit, compressed
twice. A browser unpacks and compiles that anew at every opening. Here it is done once, when the
console starts. This file knows how viser 1.1 packs, and a test holds it to the installed version.
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
_CHANGES: Final = (
    # What the client shows until the server says otherwise, as ours always does. A picture of
    # surroundings: decoding it holds a software renderer up for seconds.
    (re.compile(rb"`data:image/jpeg;base64,[A-Za-z0-9+/=]+`"), rb"null"),
    # Lights whose shadows take a compilation of their own.
    (
        re.compile(rb"enableDefaultLights:!0,enableDefaultLightsShadows:!0"),
        rb"enableDefaultLights:!1,enableDefaultLightsShadows:!1",
    ),
    # Where a connection begins, and where a batch of messages is taken: `map_first.js` is asked.
    (
        re.compile(rb"\b(\w+)\.messageQueue\.length=0,\1\.firstMessageBatch=!0"),
        rb"\g<0>,globalThis.ipponMapFirst.begin()",
    ),
    (
        re.compile(rb"function (\w+)\((\w+),(\w+)\)\{(?=let \w+=\2\.messageQueue,)"),
        rb"\g<0>\3=globalThis.ipponMapFirst.sieve(\3,\2.messageQueue,held=>\1(\2,held));",
    ),
)
"""What is written in the client, and in its place."""
_BASE: Final = 88
_GROUP: Final = 5
"""Digits that hold four bytes."""


class PackingError(Exception):
    """The page is not what viser 1.1 ships."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClientFiles:
    """viser's client as a page and what it loads."""

    page: bytes
    """HTML that loads the files."""
    files: dict[str, bytes]
    """Content by name; a name changes with its content, so browsers may keep it for good."""
    links: bytes
    """HTML that has a browser fetch the program before it opens the page."""


def unpack_client(page: bytes, prefix: str) -> ClientFiles:
    """Take viser's client apart.

    Args:
        page: The one HTML file that viser ships.
        prefix: Path that the files will be served under, with a slash at its end.

    Raises:
        PackingError: It is packed in a way that is not known here.
    """
    found = _SCRIPT.search(page)
    if found is None:
        raise PackingError("viser's page holds no script as viser 1.1 packs it")
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
    """Leave out what would be shown before the server's first message, and let the map be first."""
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
    """Read bytes that are written as groups of five digits for four bytes, the last one shorter."""
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
