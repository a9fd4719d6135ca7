"""Key in a token: a security key, a module or a TPM, through PKCS #11.

The token makes the key and signs with it; the private key cannot be copied. The station keeps the
token's location, the public key and the PIN. Ed25519 if the token supports it, else ECDSA on
P-256; see PKCS #11 3.1, 6.3.12 (EDDSA) and 6.3.9 (ECDSA of a hash).
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import secrets
import threading
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

import msgspec

from ocmm_core.errors import StorageError
from ocmm_core.plugins import install_line
from ocmm_core.seals._public import compressed_p256, low_s, public_from_text, public_text, verifies

if TYPE_CHECKING:
    from pkcs11 import Key, Session, _pkcs11

_SCHEMA = "ocmm.token/1"
# RFC 8410 (1.3.101.112) and SEC 2 (1.2.840.10045.3.1.7), DER.
_ED25519: Final = bytes.fromhex("06032b6570")
_P256: Final = bytes.fromhex("06082a8648ce3d030107")
_LABEL = "OCMM station key"
_TEST: Final = b"ocmm token 1"
_IN_WORDS: Final = {
    "NoSuchToken": "it is not there",
    "TokenNotPresent": "it is not there",
    "DeviceRemoved": "it was taken out",
    "MultipleTokensReturned": "several have this label",
    "NoSuchKey": "it does not hold this key",
    "PinLocked": "it is locked after wrong PINs",
    "MechanismInvalid": "it knows neither Ed25519 nor ECDSA on P-256",
}


class TokenPlace(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Location and PIN of a token."""

    module: str
    """PKCS #11 library of its manufacturer: the path of a .so or .dll."""
    label: str
    pin: str
    """User PIN, with the keys of the station: it signs only with the token."""

    @property
    def shown(self) -> str:
        return f"token {self.label} ({self.module})"

    def __repr__(self) -> str:
        """Omit the PIN, which must not get into logs."""
        return self.shown


class TokenKey(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Record of a key in a token."""

    schema: str = _SCHEMA
    place: TokenPlace
    key_id: str
    """Identifier of the key in the token, hexadecimal."""
    public: str

    @property
    def public_bytes(self) -> bytes:
        """Return the public key; InputError if invalid."""
        return public_from_text(self.public)

    def sign(self, content: bytes) -> bytes:
        """Return the signature, 64 bytes; StorageError: token absent or locked, or no such key."""
        import pkcs11

        with _TOKENS.opened(self.place, write=False) as session:
            private = session.get_key(pkcs11.ObjectClass.PRIVATE_KEY, id=bytes.fromhex(self.key_id))
            signature = _signed(private, content)
        if not verifies(self.public_bytes, content, signature):
            raise _refused(self.place, "its key is another one")
        return signature


def make_token_key(place: TokenPlace) -> TokenKey:
    """Make a key in a token, return its record; StorageError: no token, locked, no usable key."""
    import pkcs11
    from pkcs11 import Attribute, KeyType, Mechanism

    key_id = secrets.token_bytes(8)
    with _TOKENS.opened(place, write=True) as session:
        known = session.token.slot.get_mechanisms()
        edwards = {Mechanism.EDDSA, Mechanism.EC_EDWARDS_KEY_PAIR_GEN} <= known
        kind, curve, how = (
            (KeyType.EC_EDWARDS, _ED25519, Mechanism.EC_EDWARDS_KEY_PAIR_GEN)
            if edwards
            else (KeyType.EC, _P256, Mechanism.EC_KEY_PAIR_GEN)
        )
        parameters = session.create_domain_parameters(
            kind, {Attribute.EC_PARAMS: curve}, local=True
        )
        public_key, private = parameters.generate_keypair(
            mechanism=how, store=True, label=_LABEL, id=key_id,
            private_template={Attribute.SENSITIVE: True, Attribute.EXTRACTABLE: False},
        )  # fmt: skip
        try:
            # An octet string (04, length) around the 32 bytes, or the 65 of an uncompressed point.
            point = bytes(public_key[Attribute.EC_POINT])
            public = point[-32:] if edwards else compressed_p256(point[-65:])
            sound = verifies(public, _TEST, _signed(private, _TEST))
        except (ValueError, pkcs11.PKCS11Error):
            sound = False
        if not sound:
            private.destroy()
            public_key.destroy()
            raise _refused(place, "it made a key that does not verify")
    return TokenKey(place=place, key_id=key_id.hex(), public=public_text(public))


def _signed(private: Key, content: bytes) -> bytes:
    from pkcs11 import KeyType, Mechanism, SignMixin

    if not isinstance(private, SignMixin):
        raise TypeError("its key signs nothing")
    if private.key_type is KeyType.EC_EDWARDS:
        return bytes(private.sign(content, mechanism=Mechanism.EDDSA))
    return low_s(bytes(private.sign(hashlib.sha256(content).digest(), mechanism=Mechanism.ECDSA)))


class _Tokens:
    """Tokens of this process, called one at a time: a login holds for the whole process.

    A token locks after wrong PINs: a refused PIN is not tried again.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._libraries: dict[tuple[str, int], _pkcs11.lib] = {}
        self._wrong: set[TokenPlace] = set()

    @contextlib.contextmanager
    def opened(self, place: TokenPlace, *, write: bool) -> Iterator[Session]:
        """Open a session with a token; all its errors become a StorageError."""
        try:
            import pkcs11
        except ImportError as error:
            raise StorageError(
                "key.token_reader",
                "The key of this station is in a token, and the package python-pkcs11, which reads "
                "tokens, is not installed here.",
                f"Install it: {install_line('token')}. Or use the computer on which the token was "
                "set up.",
            ) from error
        with self._lock:
            if place in self._wrong:
                raise _wrong_pin(place)
            try:
                token = self._library(place.module).get_token(token_label=place.label)
                with token.open(rw=write, user_pin=place.pin) as session:
                    yield session
            except (pkcs11.PinIncorrect, pkcs11.PinInvalid, pkcs11.PinLenRange) as error:
                self._wrong.add(place)
                raise _wrong_pin(place) from error
            except StorageError:
                raise
            # An unsupported operation of a module raises any of these.
            except (RuntimeError, OSError, ValueError, TypeError) as error:
                name = type(error).__name__
                # A token that was removed is found again only by a reinitialized module.
                self._libraries.pop((place.module, os.getpid()), None)
                raise _refused(place, _IN_WORDS.get(name) or str(error) or name) from error

    def _library(self, module: str) -> _pkcs11.lib:
        import pkcs11

        name = (module, os.getpid())
        if name not in self._libraries:
            library = pkcs11.lib(module)
            # After a fork a module must be reinitialized (PKCS #11 3.1, 5.4); harmless otherwise.
            library.reinitialize()
            self._libraries[name] = library
        return self._libraries[name]


_TOKENS = _Tokens()


def _wrong_pin(place: TokenPlace) -> StorageError:
    return StorageError(
        "key.token_pin",
        f"The {place.shown} refuses the PIN that the station keeps; it is not tried again, because "
        "a token closes after a few wrong ones.",
        "Set the PIN of the token to what it was, then repeat; or make a new key in a file: "
        "ocmm key replace",
    )


def _refused(place: TokenPlace, why: str) -> StorageError:
    return StorageError(
        "key.token",
        f"The {place.shown} with the key of this station cannot be used ({why}).",
        "Plug it in and start its service, then repeat. If it is lost, make a new key in a file: "
        "ocmm key replace",
    )
