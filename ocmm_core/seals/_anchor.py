"""Signed list of the ends in the memory, kept outside this computer (an archive, another disk).

A second computer that trusts the station learns from it how far its histories went, and the
station itself recognizes that its own memory was set back.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from datetime import datetime

import msgspec

from ocmm_core.errors import OcmmError, StorageError
from ocmm_core.seals._key import KeyFolder
from ocmm_core.seals._memory import KnownEnd, memory_folder, recall, remember
from ocmm_core.seals._public import public_text
from ocmm_core.seals._signature import Signature, Signed, judge_signature, sign
from ocmm_core.side_files import SIDE_FILES, Trusted, read_guarded

_MOST_MEMORY = SIDE_FILES[Trusted.MEMORY][0].most

_MOST = 1000
"""Ends in a list: a station has some for each rig and probe."""


class _Heads(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    heads: tuple[KnownEnd, ...]


class _SignedHeads(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    content: _Heads
    signature: Signature


def signed_heads(keys: KeyFolder, kept: Sequence[str] = ()) -> str:
    """Return the signed ends of all histories in the memory; empty if there is nothing to keep.

    The ends of jobs are in the signed jobs themselves, which an archive holds.

    Parameters
    ----------
    kept
        Lists that are kept already; one of this station with the same ends is not made again.

    Raises
    ------
    StorageError
        The key of the station cannot be used.
    """
    heads = tuple(
        msgspec.structs.replace(seen, utc="", place="")
        for seen in sorted(_histories(), key=lambda one: one.name)[:_MOST]
    )
    if not heads:
        return ""
    content, key = _Heads(heads), keys.station_key()
    for text in kept:
        with contextlib.suppress(ValueError, RecursionError):
            known = msgspec.json.decode(text, type=_SignedHeads)
            if known.content == content and known.signature.key == public_text(key.public):
                return ""
    signature = sign(key, Signed.MEMORY, msgspec.json.encode(content))
    return msgspec.json.encode(_SignedHeads(content, signature)).decode("ascii")


def learn_heads(text: str, place: str, keys: KeyFolder) -> int:
    """Add ends that go further than those known here to the memory; return how many there were.

    Parameters
    ----------
    text
        From `signed_heads` of this or a trusted station.
    place
        Where it was found, for messages.

    Raises
    ------
    StorageError
        It is not such a list, or no trusted station signed it.
    """
    try:
        found = msgspec.json.decode(text, type=_SignedHeads)
    except (ValueError, RecursionError) as error:
        raise _refused(place, "it is damaged") from error
    content = msgspec.json.encode(found.content)
    state = judge_signature(keys, Signed.MEMORY, content, found.signature)
    if not state.sound:
        raise _refused(place, f"its signature is {state.word.value}")
    learned = 0
    for seen in found.content.heads:
        with contextlib.suppress(StorageError, ValueError):
            learned += _learn(msgspec.structs.replace(seen, place=place))
    return learned


def _learn(seen: KnownEnd) -> bool:
    known = recall(seen.name)
    if known is not None and not _is_later(seen, known):
        return False
    remember(seen if known is None else msgspec.structs.replace(seen, utc=known.utc))
    return True


def _is_later(seen: KnownEnd, known: KnownEnd) -> bool:
    if seen.moment and known.moment:
        return datetime.fromisoformat(seen.moment) > datetime.fromisoformat(known.moment)
    return seen.count > known.count


def _histories() -> Iterator[KnownEnd]:
    """Return the ends of histories, and of the things that they are about."""
    for path in memory_folder().glob("*.json"):
        with contextlib.suppress(OSError, ValueError, OcmmError, RecursionError):
            seen = recall(
                msgspec.json.decode(
                    read_guarded(path, _MOST_MEMORY, follow=False), type=KnownEnd
                ).name
            )
            if seen is not None and seen.count and (seen.thing or seen.first):
                yield seen


def _refused(place: str, why: str) -> StorageError:
    return StorageError(
        "memory.heads",
        f"{place}: the list of known ends is not taken over ({why}).",
        "If a station of yours wrote it, trust its key first: ocmm key trust.",
    )
