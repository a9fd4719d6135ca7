"""Who wrote it, and is it all: signatures with the key of this station, and what it remembers.

In: the head of a chain or the hashes of files. Out: a signature of them, whether one is good and
whose it is, and how far a chain went when this station saw it last.

Read `_key` (the key of the station, in a file or in one of `_tokens`, and the `_ring` of those that
are believed), `_public` (what verifies), `_signature` (what is signed, and what is said of it) and
`_memory` (what shows a copy of an older day). It must not know what the chains and files are about.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.seals._key import THIS_STATION, KeptKeys, KeyFolder, StationKey
    from ocmm_core.seals._memory import (
        Seen,
        expect,
        memory_folder,
        memory_loss,
        recall,
        remember,
        set_station_clock,
        start_memory,
        station_clock,
    )
    from ocmm_core.seals._public import public_from_text, public_text, shown_key
    from ocmm_core.seals._ring import KnownKey
    from ocmm_core.seals._signature import (
        SealState,
        SealWord,
        Signature,
        Signed,
        judge_signature,
        sign,
    )
    from ocmm_core.seals._tokens import TokenPlace
else:
    __getattr__ = door(
        __name__,
        _key="KeptKeys KeyFolder StationKey THIS_STATION",
        _memory=(
            "Seen expect memory_folder memory_loss recall remember set_station_clock start_memory "
            "station_clock"
        ),
        _public="public_from_text public_text shown_key",
        _ring="KnownKey",
        _signature="SealState SealWord Signature Signed judge_signature sign",
        _tokens="TokenPlace",
    )

__all__ = [
    "THIS_STATION",
    "KeptKeys",
    "KeyFolder",
    "KnownKey",
    "SealState",
    "SealWord",
    "Seen",
    "Signature",
    "Signed",
    "StationKey",
    "TokenPlace",
    "expect",
    "judge_signature",
    "memory_folder",
    "memory_loss",
    "public_from_text",
    "public_text",
    "recall",
    "remember",
    "set_station_clock",
    "shown_key",
    "sign",
    "start_memory",
    "station_clock",
]
