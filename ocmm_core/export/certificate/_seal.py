"""Certificates written and read with their signatures.

This station signs inside the document (`_xml_signature`). Before 2026-11-28 it signed the canonical
form in a separate file (`SEAL_SUFFIX`), which is still read.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from ocmm_core import seals
from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError, StorageError
from ocmm_core.export import write_together
from ocmm_core.export.certificate._content import Certificate
from ocmm_core.export.certificate._dcc import dcc_tree
from ocmm_core.export.certificate._reader import LARGEST, Dcc, read_dcc
from ocmm_core.export.certificate._xml_signature import (
    TrustedSigners,
    XmlSignatureWord,
    trusted_signers,
    xml_signed,
)

SCHEMA = "ocmm.certificate-seal/1"
CERTIFICATE_ENDING: str = ".dcc.xml"
SEAL_SUFFIX: str = ".sig.json"
Pages = Callable[[Mapping[str, bytes]], bytes]
"""Draws the pages of a certificate with these files inside."""


class CertificateSeal(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Content of a detached signature: number of the certificate, and signature."""

    schema: str
    number: str
    signature: seals.Signature


@dataclass(frozen=True, slots=True)
class DccFound:
    """A certificate and the state of its signatures."""

    dcc: Dcc
    state: seals.SealState
    """State of a station's signature, in the document or detached."""

    @property
    def sound(self) -> bool:
        """Return whether a trusted signer signed exactly this content, without contradiction."""
        word = self.dcc.signature.word
        if word is XmlSignatureWord.NONE or word is XmlSignatureWord.UNKNOWN_SIGNER:
            return self.state.sound
        return word is XmlSignatureWord.VALID and self.state.word in (
            seals.SealWord.SEALED, seals.SealWord.NOT_SIGNED,
        )  # fmt: skip

    @property
    def summary(self) -> str:
        """Return its signatures, for people."""
        if self.dcc.signature.word is not XmlSignatureWord.NONE:
            return f"{self.dcc.signature.summary}."
        if self.state.sound:
            return f"Signed by {self.state.signer}."
        return f"{self.state.word.value}: for information only."


def write_certificate(paper: Certificate, folder: Path) -> Path:
    """Write the signed DCC of a certificate and return its path.

    StorageError: a number is not finite, the file read back differs, or the folder or the key of
    this station cannot be used.
    """
    name, content = _signed(paper)
    write_together({folder / name: content})
    return folder / name


def write_certificates(
    papers: Sequence[tuple[Certificate, Pages]], folder: Path
) -> tuple[Path, ...]:
    """Write all files of `signed_certificates` or none; StorageError as `write_certificate`."""
    files = signed_certificates(papers, folder)
    write_together(files)
    return tuple(files)


def signed_certificates(
    papers: Sequence[tuple[Certificate, Pages]], folder: Path
) -> dict[Path, bytes]:
    """Return pages with the DCC, and signed DCC, of all; errors as `write_certificate`."""
    files: dict[Path, bytes] = {}
    for paper, pages in papers:
        name, content = _signed(paper)
        files |= {folder / f"{paper.number}.pdf": pages({name: content}), folder / name: content}
    return files


def check_dcc_seal(path: Path, keys: seals.KeyFolder) -> DccFound:
    """Return a certificate with its signatures; InputError or StorageError if unreadable."""
    dcc = read_dcc(read_bytes(path, LARGEST), trusted_signers(keys))
    beside = path.with_name(path.name + SEAL_SUFFIX)
    signature = None
    if beside.exists():
        try:
            seal = msgspec.json.decode(read_bytes(beside), type=CertificateSeal)
        except (ValueError, RecursionError) as error:
            raise _no_seal(beside, str(error)) from error
        if seal.schema != SCHEMA:
            raise _no_seal(beside, f"its schema is {seal.schema!r}")
        signature = seal.signature
    detached = seals.judge_signature(keys, seals.Signed.CERTIFICATE, dcc.canonical, signature)
    inside = dcc.signature.station
    return DccFound(dcc, detached if inside is None or signature is not None else inside)


def _signed(paper: Certificate) -> tuple[str, bytes]:
    """Return name and content of the signed DCC, verified by reading back."""
    key = seals.KeyFolder().station_key()
    content = xml_signed(dcc_tree(paper), seals.document_key(key, paper.number))
    read = read_dcc(
        content, TrustedSigners(stations={seals.public_text(key.public): seals.THIS_STATION})
    )
    _require_same(paper, read)
    return f"{paper.number}{CERTIFICATE_ENDING}", content


def _require_same(paper: Certificate, read: Dcc) -> None:
    wanted = [
        number
        for run in paper.runs
        for line in run.lines
        for number in (line.measured, line.reference, line.error, line.limit)
    ] + [value.value for value in (*paper.values_before, *paper.values)]
    unc = [line.expanded for run in paper.runs for line in run.lines]
    stated = (*paper.values_before, *paper.values)
    unc += [value.expanded for value in stated if value.expanded is not None]
    told = [quantity.value for quantity in read.quantities]
    same = told == wanted and [one.expanded for one in read.quantities if one.k is not None] == unc
    if not same or read.signature.word is not XmlSignatureWord.VALID:
        raise StorageError(
            "certificate.differs",
            f"The certificate {paper.number} was read back, and its numbers or signature differ.",
            "Nothing was written. Send the record to the maintainers of this program.",
        )


def _no_seal(path: Path, why: str) -> InputError:
    return InputError(
        "certificate.seal",
        f"{path}: this is not the signature of a certificate ({why}).",
        f"Give the file ending in {SEAL_SUFFIX} that came with the certificate.",
    )
