"""Signatures and completeness: key of this station, trusted keys, and remembered chains.

In: the head of a chain, or the hashes of files. Out: a signature, its state and signer, and the
last recorded end of a chain.

Read `_key` (the key of the station, in a file or in one of `_tokens`, and the `_ring` of trusted
keys), `_public` (verification), `_signature` (kinds of signed content, and states), `_release` (a
file released by name), `_x509` (certificates for other programs), `_memory` and `_memory_start`
(detect older copies), and `_anchor` (keeps its ends elsewhere).
It must not know the content of chains and files.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.seals._anchor import learn_heads, signed_heads, signed_job_heads
    from ocmm_core.seals._key import (
        KEY_IN_FORCE,
        THIS_STATION,
        KeptKeys,
        KeyFolder,
        StationKey,
        key_lost,
    )
    from ocmm_core.seals._memory import (
        KnownEnd,
        expect,
        memory_file,
        memory_folder,
        recall,
        remember,
        set_station_clock,
        station_clock,
    )
    from ocmm_core.seals._memory_start import memory_loss, memory_start, start_memory
    from ocmm_core.seals._public import public_from_text, public_text, shown_key
    from ocmm_core.seals._release import (
        NO_RELEASE,
        RELEASE_ENDING,
        Release,
        ReleaseState,
        judge_release,
        release_file,
        release_path,
        release_state,
    )
    from ocmm_core.seals._ring import KnownKey
    from ocmm_core.seals._signature import (
        NOT_SIGNED,
        SealState,
        SealWord,
        Signature,
        Signed,
        judge_signature,
        sign,
    )
    from ocmm_core.seals._tokens import TokenPlace
    from ocmm_core.seals._x509 import (
        DocumentKey,
        document_key,
        station_certificate,
        station_of,
        write_station_certificate,
    )
else:
    __getattr__ = door(
        __name__,
        _anchor="learn_heads signed_heads signed_job_heads",
        _key="KEY_IN_FORCE KeptKeys KeyFolder StationKey THIS_STATION key_lost",
        _memory=(
            "KnownEnd expect memory_file memory_folder recall remember set_station_clock "
            "station_clock"
        ),
        _memory_start="memory_loss memory_start start_memory",
        _public="public_from_text public_text shown_key",
        _release=(
            "NO_RELEASE RELEASE_ENDING Release ReleaseState judge_release "
            "release_file release_path release_state"
        ),
        _ring="KnownKey",
        _signature="NOT_SIGNED SealState SealWord Signature Signed judge_signature sign",
        _tokens="TokenPlace",
        _x509=("DocumentKey document_key station_certificate station_of write_station_certificate"),
    )

__all__ = [
    "KEY_IN_FORCE", "NOT_SIGNED", "NO_RELEASE", "RELEASE_ENDING", "THIS_STATION", "DocumentKey",
    "KeptKeys", "KeyFolder", "KnownEnd", "KnownKey", "Release", "ReleaseState", "SealState",
    "SealWord", "Signature", "Signed", "StationKey", "TokenPlace", "document_key", "expect",
    "judge_release", "judge_signature", "key_lost", "learn_heads", "memory_file", "memory_folder",
    "memory_loss", "memory_start", "public_from_text", "public_text", "recall", "release_file",
    "release_path", "release_state", "remember", "set_station_clock", "shown_key", "sign",
    "signed_heads", "signed_job_heads", "start_memory", "station_certificate", "station_clock",
    "station_of", "write_station_certificate",
]  # fmt: skip
