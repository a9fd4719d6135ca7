"""Possible changes of the content of one file, for `benchmarks.evidence`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

Rng = np.random.Generator


def bit(rng: Rng, content: bytes) -> bytes:
    """Flip one bit."""
    at = int(rng.integers(len(content)))
    return content[:at] + bytes([content[at] ^ (1 << int(rng.integers(8)))]) + content[at + 1 :]


def bytes_changed(rng: Rng, content: bytes) -> bytes:
    """Write one to eight others over bytes."""
    count = int(rng.integers(1, 9))
    at = int(rng.integers(max(1, len(content) - count)))
    return content[:at] + rng.bytes(count) + content[at + count :]


def digit(rng: Rng, content: bytes) -> bytes:
    """Change one digit, as a person does in an editor."""
    digits = [at for at, sign in enumerate(content) if chr(sign).isdigit()]
    at = int(rng.choice(digits))
    return content[:at] + b"%d" % int(rng.integers(10)) + content[at + 1 :]


def appended(rng: Rng, content: bytes) -> bytes:
    """Write something behind the end."""
    more = (b"\n", b" ", b"{}\n", content.splitlines(keepends=True)[-1], rng.bytes(20))
    return content + more[int(rng.integers(len(more)))]


def cut(rng: Rng, content: bytes) -> bytes:
    """Leave only the beginning."""
    return content[: int(rng.integers(1, len(content)))]


def last_lines(rng: Rng, content: bytes) -> bytes:
    """Take out the last one to three lines; a file of one line loses its end."""
    lines = content.splitlines(keepends=True)
    return b"".join(lines[: -int(rng.integers(1, 4))]) if len(lines) > 3 else content[:-1]


def line_out(rng: Rng, content: bytes) -> bytes:
    """Take out one line."""
    lines = content.splitlines(keepends=True)
    del lines[int(rng.integers(len(lines)))]
    return b"".join(lines)


def swapped(rng: Rng, content: bytes) -> bytes:
    """Exchange two lines; in a file of one line two halves."""
    lines = content.splitlines(keepends=True)
    if len(lines) < 2:
        half = len(content) // 2
        return content[half:] + content[:half]
    one, other = (int(i) for i in rng.choice(len(lines), 2, replace=False))
    lines[one], lines[other] = lines[other], lines[one]
    return b"".join(lines)


def emptied(rng: Rng, content: bytes) -> bytes:
    """Leave an empty file."""
    return b""


EDITS: tuple[Callable[[Rng, bytes], bytes], ...] = (
    bit, bytes_changed, digit, appended, cut, last_lines, line_out, swapped, emptied,
)  # fmt: skip
