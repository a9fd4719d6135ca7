"""Bytes that no device should send: seeded, random and made from good ones."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence

from ocmm_core.errors import OcmmError

_EDGES = (0, 1, 0x7F, 0x80, 0xFF)
_LONGEST = 1600


def spoiled(seed: int, count: int, samples: Sequence[bytes]) -> Iterator[bytes]:
    """Yield ``count`` byte strings: a tenth random, the others one to four changes to a sample."""
    chance = random.Random(seed)  # noqa: S311 - reproducible, not secret
    for _ in range(count):
        if chance.random() < 0.1:
            yield chance.randbytes(chance.randrange(_LONGEST))
            continue
        content = bytearray(chance.choice(samples))
        for _ in range(chance.randrange(1, 5)):
            _spoil(content, samples, chance)
        yield bytes(content)


def outcomes(decode: Callable[[bytes], object], contents: Iterator[bytes]) -> tuple[int, int]:
    """Decode everything; return the numbers accepted and refused with an `OcmmError`.

    Any other exception propagates and fails the test.
    """
    taken = refused = 0
    for content in contents:
        try:
            decode(content)
        except OcmmError:
            refused += 1
        else:
            taken += 1
    return taken, refused


def _spoil(content: bytearray, samples: Sequence[bytes], chance: random.Random) -> None:
    """Change a random place, mostly near the beginning with the heads."""
    if not content:
        content += chance.randbytes(4)
        return
    near = min(len(content), 40) if chance.random() < 0.7 else len(content)
    at = chance.randrange(near)
    kind = chance.randrange(6)
    if kind == 0:
        content[at] ^= 1 << chance.randrange(8)
    elif kind == 1:
        content[at] = chance.choice(_EDGES)
    elif kind == 2:
        content[at : at + chance.choice((2, 4))] = chance.randbytes(chance.choice((2, 4)))
    elif kind == 3:
        del content[chance.randrange(len(content)) :]
    elif kind == 4:
        del content[at : at + chance.randrange(1, 9)]
    else:
        other = chance.choice(samples)
        content[at:at] = other[: chance.randrange(len(other) + 1)]
        del content[_LONGEST:]
