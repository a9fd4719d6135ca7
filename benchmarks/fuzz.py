"""Every parser of files and frames, given damaged samples without end.

    python -m benchmarks.fuzz [--parser NAME] [--executions N] [--seconds S] [--seed S] [--keep DIR]

Samples are good ones; each execution changes one to eight places of one (bits, pieces cut out,
doubled or taken from another sample, numbers and words that parsers stumble over). What is right is
a result or an error of the product with one sentence; anything else is a fault and is kept. Prints
for every parser how many were run and refused, the slowest, and the faults; ends with 1 if there is
one, or if one execution took more than a second.
"""

from __future__ import annotations

import argparse
import hashlib
import random
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from ocmm_core.errors import OcmmError
from tests.core.fuzz_targets import PARSERS, Parser

LONGEST_S = 1.0
_WORDS = (
    b"\xff\xfe", b"\xc3", b"\xed\xa0\x80", b"\0", b"\n", b'"', b"'", b"[", b"{", b"}", b"]", b"=",
    b"-1", b"1e999", b"nan", b"inf", b"0", b"18446744073709551616", b"9" * 400, b"9" * 5000,
    b"null", b"true", b"a.a.a.a", b"[[", b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff", b"\0\0\0\x80",
    b"<b>x</b>", b"../..", b"#", b",", b";", b"\t", b"\r", b"1e-320", b"1_0",
)  # fmt: skip


@dataclass(slots=True)
class Found:
    """Outcome of the executions: counts, the slowest in s, and faults by exception."""

    done: int = 0
    refused: int = 0
    slowest_s: float = 0.0
    faults: dict[str, bytes] = field(default_factory=dict)


def damaged(sample: bytes, samples: tuple[bytes, ...], chance: random.Random) -> bytes:
    """Return a sample with one to eight places changed."""
    content = bytearray(sample)
    for _ in range(chance.choice((1, 1, 1, 2, 2, 3, 5, 8))):
        at = chance.randrange(len(content) + 1)
        size = min(int(2.0 ** chance.uniform(0.0, 9.0)), 400)
        way = chance.randrange(7)
        if way == 0 and at < len(content):
            content[at] ^= 1 << chance.randrange(8)
        elif way == 1:
            content[at : at + size] = chance.randbytes(min(size, 8))
        elif way == 2:
            del content[at : at + size]
        elif way == 3:
            content[at:at] = content[at : at + size]
        elif way == 4:
            other = chance.choice(samples)
            start = chance.randrange(len(other) + 1)
            content[at : at + size * chance.randrange(2)] = other[start : start + size]
        elif way == 5:
            word = chance.choice(_WORDS)
            content[at : at + len(word) * chance.randrange(2)] = word
        else:
            # A whole number or word is exchanged, and its former meaning is displaced.
            end = at
            while end < len(content) and chr(content[end]) in "0123456789.-+eE":
                end += 1
            content[at:end] = chance.choice(_WORDS)
    return bytes(content)


def run(
    parser: Parser, executions: int, seconds: float, seed: int, tell: Callable[[str, bytes], None]
) -> Found:
    """Give a parser a number of damaged samples, within the available time."""
    chance = random.Random(seed)  # noqa: S311 - repeatable, not secret
    found = Found()
    with tempfile.TemporaryDirectory(prefix="ocmm-fuzz-", dir=_fast_folder()) as name:
        parse = parser.opened(Path(name))
        until = time.perf_counter() + seconds
        for _ in range(executions):
            if time.perf_counter() > until:
                break
            content = damaged(chance.choice(parser.samples), parser.samples, chance)
            begun = time.thread_time()
            try:
                parse(content)
            except OcmmError:
                found.refused += 1
            except BaseException as error:
                if isinstance(error, KeyboardInterrupt):
                    raise
                place = error.__traceback__
                while place is not None and place.tb_next is not None:
                    place = place.tb_next
                line = 0 if place is None else place.tb_lineno
                words = f"{type(error).__name__} in line {line}: {str(error)[:100]}"
                if words.split(":")[0] not in {one.split(":")[0] for one in found.faults}:
                    found.faults[words] = content
                    tell(words, content)
            took = time.thread_time() - begun
            if took > LONGEST_S and took > found.slowest_s:
                tell(f"{took:.1f} s", content)
            found.slowest_s = max(found.slowest_s, took)
            found.done += 1
    return found


def main() -> int:
    """Run the parsers; return 0 without faults."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--parser", choices=sorted(PARSERS))
    parser.add_argument("--executions", type=int, default=1_000_000)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--keep", type=Path)
    options = parser.parse_args()
    good = True

    def tell(words: str, content: bytes) -> None:
        if options.keep is not None:
            options.keep.mkdir(parents=True, exist_ok=True)
            name = hashlib.sha256(content).hexdigest()[:16]
            (options.keep / f"{options.parser or 'any'}-{name}").write_bytes(content)

    for name in [options.parser] if options.parser else sorted(PARSERS):
        made = PARSERS[name]()
        found = run(made, options.executions, options.seconds, options.seed, tell)
        sys.stdout.write(
            f"{name:10s} {found.done:8d} executions, {found.refused} refused, slowest "
            f"{1e3 * found.slowest_s:.1f} ms, {len(found.faults)} kinds of faults\n"
        )
        for words in found.faults:
            sys.stdout.write(f"    {words}\n")
        sys.stdout.flush()
        good = good and not found.faults and found.slowest_s <= LONGEST_S
    return 0 if good else 1


def _fast_folder() -> str | None:
    return "/dev/shm" if Path("/dev/shm").is_dir() else None  # noqa: S108 - a private folder in it


if __name__ == "__main__":
    sys.exit(main())
