import random

import pytest

from app.messages.cdr import MessageError


def _mutations(payload, count, seed):
    """Yield damaged copies: bytes flipped, cut short, lengths made absurd, garbage."""
    rng = random.Random(seed)
    for _ in range(count):
        damaged = bytearray(payload)
        match rng.randrange(5):
            case 0:
                for _ in range(rng.randint(1, 8)):
                    damaged[rng.randrange(len(damaged))] = rng.randrange(256)
            case 1:
                del damaged[rng.randrange(len(damaged)) :]
            case 2:
                at = rng.randrange(max(1, len(damaged) - 4))
                damaged[at : at + 4] = rng.choice(
                    [b"\xff\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\0\x80", b"\0\0\0\0"]
                )
            case 3:
                at = rng.randrange(len(damaged))
                damaged[at:at] = rng.randbytes(rng.randint(1, 64))
            case 4:
                damaged = bytearray(damaged[:4] + rng.randbytes(rng.randint(0, 200)))
        yield bytes(damaged)


@pytest.fixture
def survives_damage():
    """Check that a decoder answers damaged payloads with a message or a MessageError, only."""

    def check(decode, payload, *, count=400):
        refused = 0
        for damaged in _mutations(payload, count, seed=len(payload)):
            try:
                decode(damaged)
            except MessageError:
                refused += 1
        assert refused > count // 4, "most of the damage must be noticed"

    return check
