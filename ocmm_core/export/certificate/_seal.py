"""The signature of a certificate: detached, by the key of this station, over the canonical form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from ocmm_core.documents import read_bytes
from ocmm_core.errors import InputError, StorageError
from ocmm_core.export import write_together
from ocmm_core.export.certificate._content import Certificate
from ocmm_core.export.certificate._dcc import dcc_bytes
from ocmm_core.export.certificate._reader import LARGEST, Dcc, read_dcc
from ocmm_core.export.certificate._xml_signature import XmlSignatureWord, trusted_laboratories
from ocmm_core.seals import KeyFolder, SealState, SealWord, Signature, Signed, judge_signature, sign

SCHEMA = "ocmm.certificate-seal/1"
CERTIFICATE_ENDING: str = ".dcc.xml"
SEAL_SUFFIX: str = ".sig.json"


class CertificateSeal(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The content of the file beside a certificate: its number and the signature on it."""

    schema: str
    number: str
    signature: Signature


@dataclass(frozen=True, slots=True)
class DccFound:
    """A certificate that was read, and what is to be said of its signature."""

    dcc: Dcc
    state: SealState

    @property
    def sound(self) -> bool:
        """Return whether a trusted signer signed exactly this content, and nothing contradicts."""
        word = self.dcc.signature.word
        if word is XmlSignatureWord.NONE or word is XmlSignatureWord.UNKNOWN_SIGNER:
            return self.state.sound
        return word is XmlSignatureWord.VALID and self.state.word in (
            SealWord.SEALED, SealWord.NOT_SIGNED,
        )  # fmt: skip

    @property
    def words(self) -> str:
        """Return its signatures, for people."""
        if self.dcc.signature.word is not XmlSignatureWord.NONE:
            return f"{self.dcc.signature.words}."
        if self.state.sound:
            return f"Signed by {self.state.signer}."
        return f"{self.state.word.value}: for information only."


def write_certificate(paper: Certificate, folder: Path) -> tuple[Path, Path]:
    """Write the DCC of a paper and its signature, both or none; return their paths.

    Raises
    ------
    StorageError
        A number is not finite, what was read back differs, or the folder or the key of this
        station cannot be used.
    """
    files = _signed(paper, folder)
    write_together(files)
    path, beside = files
    return path, beside


def write_certificates(papers: Sequence[tuple[Certificate, bytes]], folder: Path) -> tuple[
    Path, ...
]:  # fmt: skip
    """Write the pages, the DCC and its signature of every paper, all files or none.

    Parameters
    ----------
    papers
        Each with its pages as PDF.

    Returns
    -------
    Paths of the files, paper by paper, the pages first.

    Raises
    ------
    StorageError
        As `write_certificate`; nothing is written then.
    """
    files: dict[Path, bytes] = {}
    for paper, pages in papers:
        files[folder / f"{paper.number}.pdf"] = pages
        files |= _signed(paper, folder)
    write_together(files)
    return tuple(files)


def check_dcc_seal(path: Path, keys: KeyFolder) -> DccFound:
    """Return a certificate at ``path`` with what is to be said of the signature beside it.

    Raises
    ------
    InputError
        The certificate or its signature cannot be read.
    StorageError
        The ring of known keys cannot be read.
    """
    dcc = read_dcc(read_bytes(path, LARGEST), trusted_laboratories(keys.folder))
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
    return DccFound(dcc, judge_signature(keys, Signed.CERTIFICATE, dcc.canonical, signature))


def _signed(paper: Certificate, folder: Path) -> dict[Path, bytes]:
    """Return the DCC, read back, and its signature, by their paths."""
    content = dcc_bytes(paper)
    read = read_dcc(content)
    _require_same(paper, read)
    seal = CertificateSeal(
        schema=SCHEMA,
        number=paper.number,
        signature=sign(KeyFolder().station_key(), Signed.CERTIFICATE, read.canonical),
    )
    path = folder / f"{paper.number}{CERTIFICATE_ENDING}"
    beside = path.with_name(path.name + SEAL_SUFFIX)
    signed = msgspec.json.format(msgspec.json.encode(seal), indent=1) + b"\n"
    return {path: content, beside: signed}


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
    if told != wanted or [one.expanded for one in read.quantities if one.k is not None] != unc:
        raise StorageError(
            "certificate.differs",
            f"The certificate {paper.number} was read back and its numbers differ.",
            "Nothing was written. Send the record to the maintainers of this program.",
        )


def _no_seal(path: Path, why: str) -> InputError:
    return InputError(
        "certificate.seal",
        f"{path}: this is not the signature of a certificate ({why}).",
        f"Give the file ending in {SEAL_SUFFIX} that came with the certificate.",
    )
