"""Signatures and completeness: key of this station, trusted keys, and remembered chains.

In: the head of a chain, or the hashes of files. Out: a signature, its state and signer, and the
last recorded end of a chain.

Read `_key` (the key of the station, in a file or in one of `_tokens`), `_public` (verification, and
the ring of trusted keys), `_signature` (kinds of signed content, states, and files released by
name), `_x509` (certificates for other programs), `_memory` (detects older copies), and `_anchor`
(keeps its ends elsewhere, detects a missing memory).
It must not know the content of chains and files.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.seals._anchor import (
        known_ends, learn_heads, memory_loss, memory_start, signed_heads, signed_job_heads,
        start_memory,
    )  # fmt: skip
    from ocmm_core.seals._key import (
        KEY_IN_FORCE, THIS_STATION, KeptKeys, KeyFolder, StationKey, key_lost,
    )  # fmt: skip
    from ocmm_core.seals._memory import (
        KnownEnd, expect, memory_file, memory_folder, recall, remember, set_station_clock,
        station_clock,
    )  # fmt: skip
    from ocmm_core.seals._public import KnownKey, public_from_text, public_text, shown_key
    from ocmm_core.seals._signature import (
        NO_RELEASE, RELEASE_ENDING, Release, ReleaseState, SealState, SealWord, Signature, Signed,
        judge_release, judge_signature, release_file, release_path, release_state, sign,
    )  # fmt: skip
    from ocmm_core.seals._tokens import TokenPlace
    from ocmm_core.seals._x509 import (
        DocumentKey, document_key, station_certificate, station_of, write_station_certificate,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "KEY_IN_FORCE", "NO_RELEASE", "RELEASE_ENDING", "THIS_STATION", "DocumentKey", "KeptKeys",
    "KeyFolder", "KnownEnd", "KnownKey", "Release", "ReleaseState", "SealState", "SealWord",
    "Signature", "Signed", "StationKey", "TokenPlace", "document_key", "expect", "judge_release",
    "judge_signature", "key_lost", "known_ends", "learn_heads", "memory_file", "memory_folder",
    "memory_loss", "memory_start", "public_from_text", "public_text", "recall", "release_file",
    "release_path", "release_state", "remember", "set_station_clock", "shown_key", "sign",
    "signed_heads", "signed_job_heads", "start_memory", "station_certificate", "station_clock",
    "station_of", "write_station_certificate",
]  # fmt: skip
