"""Key of this station, in a private file or a token, and the ring of trusted keys.

A replaced key goes to the ring, so that its signatures still verify; so do keys of other stations.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import msgspec
import platformdirs
from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

from ocmm_core.documents import decode_json
from ocmm_core.errors import InputError, StorageError
from ocmm_core.seals._memory import KnownEnd, recall, remember
from ocmm_core.seals._private_file import guarded_content, private_temporary, unwritable
from ocmm_core.seals._public import (
    KnownKey,
    add_to_ring,
    changing,
    check_names,
    fingerprint_of,
    in_utc,
    public_from_text,
    public_text,
    read_ring,
)
from ocmm_core.seals._tokens import TokenKey, TokenPlace, make_token_key

THIS_STATION = "this station"
_KEY = "key of this station"
_PRIVATE = "station.key"
_TOKEN = "token.json"  # noqa: S105 - the name of a file
KEY_IN_FORCE = "key in force"
"""Its name in the memory."""


@dataclass(frozen=True, slots=True)
class StationKey:
    """Private key of this station."""

    _sign: Callable[[bytes], bytes]
    public: bytes
    """32 bytes of Ed25519, or 33 of ECDSA on P-256."""
    kept_in: str
    """Location of the private key, for messages."""

    @property
    def fingerprint(self) -> str:
        return fingerprint_of(self.public)

    def sign(self, content: bytes) -> bytes:
        """Return the signature, 64 bytes; StorageError if a token does not answer."""
        return self._sign(content)


def key_lost(folder: Path) -> StorageError:
    return StorageError(
        "key.lost",
        f"{folder}: the key of this station is missing. What it signed would be of an unknown "
        "station.",
        "Restore the folder from a backup. If there is none, make a new key by name with ocmm key "
        "replace.",
    )


class KeyFolder:
    """Folder of the station key and trusted keys, read at each call; None: this user's."""

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = platformdirs.user_data_path("ocmm") / "keys" if folder is None else folder
        self._own = folder is None

    def station_key(self) -> StationKey:
        """Return the key of this station; made at the first call.

        Raises StorageError if it cannot be read or made, is damaged or missing, or others can read
        it.
        """
        found = self._stored_key()
        if found is None and self._used_before() is not None:
            raise key_lost(self.folder)
        return self._noted(self._make() if found is None else found)

    def _used_before(self) -> bytes | None:
        """Return the public key that this station used last, from its memory."""
        seen = recall(KEY_IN_FORCE) if self._own else None
        return None if seen is None else public_from_text(seen.link)

    def _noted(self, key: StationKey) -> StationKey:
        if self._own:
            remember(KnownEnd(name=KEY_IN_FORCE, count=1, link=public_text(key.public)), sync=False)
        return key

    def own_public(self) -> bytes | None:
        """Return the public key of this station; None without a usable one."""
        with contextlib.suppress(StorageError):
            found = self._stored_key()
            return None if found is None else found.public
        return None

    def known(self) -> tuple[KnownKey, ...]:
        """Return the trusted keys without the one in force; StorageError if unreadable."""
        return read_ring(self.folder)

    def believed(self) -> dict[str, str]:
        """Return the station name of each trusted public key (Base64)."""
        names = {key.public: key.name for key in self.known()}
        own = self.own_public()
        if own is not None:
            names[public_text(own)] = THIS_STATION
        return names

    def trust(self, public: bytes, name: str, who: str, reason: str, now: datetime) -> KnownKey:
        """Trust the key of another station from now on.

        Raises InputError if name, person or reason is missing, or it is the key of this station;
        StorageError if the ring cannot be read or written.
        """
        check_names(name, who)
        if " ".join(name.casefold().split()) == THIS_STATION:
            raise InputError(
                "key.name",
                f"{name!r} means the computer itself.",
                "Give the name of the other one.",
            )
        if public == self.own_public():
            raise InputError(
                "key.own", "This is the key of this station.", "Nothing needs to be done."
            )
        key = KnownKey(
            public=public_text(public), name=name.strip(), since_utc=in_utc(now), who=who.strip(),
            reason=reason,
        )  # fmt: skip
        with changing(self.folder):
            add_to_ring(self.folder, key)
        return key

    def replace(
        self, who: str, reason: str, now: datetime, token: TokenPlace | None = None
    ) -> StationKey:
        """Make a new key for this station; signatures of the old one still verify.

        The old key goes to the ring first, so that at no moment a key is in force whose predecessor
        is unknown. `token`: makes the new key; None makes it in a file. Raises StorageError if the
        key or the ring cannot be read or written, or the token makes none.
        """
        lost = self._used_before() if self._stored_key() is None else None
        if lost is None:
            self.station_key()
        with changing(self.folder):
            old = lost or self.station_key().public
            in_token = None if token is None else make_token_key(token)
            moment = in_utc(now)
            kept = KnownKey(
                public=public_text(old), name=THIS_STATION, since_utc=moment, until_utc=moment,
                who=who, reason=reason,
            )  # fmt: skip
            add_to_ring(self.folder, kept)
            if in_token is None:
                self._put(_PRIVATE, _pem(Ed25519PrivateKey.generate()), instead_of=_TOKEN)
            else:
                self._put(_TOKEN, msgspec.json.encode(in_token) + b"\n", instead_of=_PRIVATE)
        return self.station_key()

    def token_place(self) -> TokenPlace | None:
        """Return the token of the station key, or None; StorageError: bad record, not private."""
        found = self._token_key()
        return None if found is None else found.place

    def _stored_key(self) -> StationKey | None:
        in_token = self._token_key()
        if in_token is not None:
            return StationKey(in_token.sign, in_token.public_bytes, in_token.place.shown)
        content = guarded_content(self.folder / _PRIVATE, _KEY, secret=True)
        if content is None:
            return None
        path = self.folder / _PRIVATE
        try:
            private = serialization.load_pem_private_key(content, password=None)
        except (ValueError, TypeError, UnsupportedAlgorithm) as error:
            raise _damaged(path) from error
        if not isinstance(private, Ed25519PrivateKey):
            raise _damaged(path)
        return self._station_key(private)

    def _station_key(self, private: Ed25519PrivateKey) -> StationKey:
        public = private.public_key().public_bytes_raw()
        return StationKey(private.sign, public, str(self.folder))

    def _token_key(self) -> TokenKey | None:
        content = guarded_content(self.folder / _TOKEN, _KEY, secret=True)
        if content is None:
            return None
        try:
            found = decode_json(content, TokenKey)
            bytes.fromhex(found.key_id)
            _ = found.public_bytes
        except (msgspec.MsgspecError, ValueError, InputError) as error:
            raise _damaged(self.folder / _TOKEN) from error
        return found

    def _make(self) -> StationKey:
        private = Ed25519PrivateKey.generate()
        temporary = private_temporary(self.folder / _PRIVATE, _pem(private))
        try:
            # Two programs that start at once make one key: the second one takes that of the first.
            os.link(temporary, self.folder / _PRIVATE)
        except FileExistsError:
            return self.station_key()
        except OSError as error:
            raise unwritable(self.folder, error) from error
        finally:
            temporary.unlink(missing_ok=True)
        return self._station_key(private)

    def _put(self, name: str, content: bytes, *, instead_of: str) -> None:
        """Put a key into force in place of the previous one, in a file or a token."""
        temporary = private_temporary(self.folder / name, content)
        try:
            temporary.replace(self.folder / name)
            # A token takes precedence over a file. If interrupted here, the previous key stays in
            # force.
            (self.folder / instead_of).unlink(missing_ok=True)
        except OSError as error:
            raise unwritable(self.folder, error) from error
        finally:
            temporary.unlink(missing_ok=True)


class KeptKeys(KeyFolder):
    """Trusted keys cached at the first request, to read many files."""

    def __init__(self, folder: Path | None = None) -> None:
        super().__init__(folder)
        self._kept: dict[str, str] | None = None

    def believed(self) -> dict[str, str]:
        if self._kept is None:
            self._kept = super().believed()
        return self._kept


def _pem(private: Ed25519PrivateKey) -> bytes:
    return private.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )


def _damaged(path: Path) -> StorageError:
    return StorageError(
        "key.damaged",
        f"{path}: the key of this station is damaged.",
        "Restore it from a backup. If there is none, move it away: a new key is made, and files "
        "of the old one are read as those of an unknown station until its public key is trusted.",
    )
