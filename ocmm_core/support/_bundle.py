"""Support bundle: collect, clean, show, then write. Nothing is sent.

Secrets are removed, and names on request, by three filters in series: secrets by value (files named
by settings, environment variables), patterns of secrets (a password in an address, `token = ...`, a
private key), and names of people. A false match costs a line of a log; a missed secret cannot be
recalled.
"""

from __future__ import annotations

import io
import platform
import re
import zipfile
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import quote, unquote

from ocmm_core.build import this_build
from ocmm_core.documents import write_atomic
from ocmm_core.errors import InputError
from ocmm_core.manual import changes_since, shipped_text
from ocmm_core.support._parts import PARTS, SupportSite, names_of, secret_texts, taken

MASKED = "[secret]"
_LEAST_SECRET = 4
"""Shorter secrets would remove half of a text; the patterns still find them."""
_LEAST_NAME = 3
_WORD = r"(?:pass(?:word|wd|phrase|code)?|pwd|(?<![a-z])pin(?![a-z])|secret|token|api[_-]?key|"
_WORD += r"access[_-]?key|private[_-]?key|credential|authori[sz]ation|kennwort|passwort)s?"
# All repetitions are bounded: a log may be one line of a megabyte.
_PATTERNS = (
    # A whole private key, also a truncated one.
    (
        re.compile(
            r"-----BEGIN [A-Z ]{0,40}PRIVATE KEY-----.*?"
            r"(?:-----END [A-Z ]{0,40}PRIVATE KEY-----|\Z)",
            re.DOTALL,
        ),
        MASKED,
    ),
    # scheme://user:password@host; the password may contain an @.
    (re.compile(r"(?P<keep>[a-z0-9+.-]{1,20}://[^\s/:@\"']{0,200}:)[^\s\"'/]{1,500}(?=@)",
                re.IGNORECASE),
     rf"\g<keep>{MASKED}"),
    # Authorization: Bearer ..., with or without the header name.
    (re.compile(r"(?P<keep>\b(?:bearer|basic|digest)\s+)[A-Za-z0-9+/=._~-]{6,}", re.IGNORECASE),
     rf"\g<keep>{MASKED}"),
    # password = "...", token: ..., --password ...
    (
        re.compile(
            rf"(?P<keep>{_WORD}[\w-]{{0,40}}[\"']?\s{{0,9}}(?:=>|[:=])\s{{0,9}})"
            r"(?:\"(?:[^\"\\]|\\.)*\"|'(?:[^'\\]|\\.)*'|[^\s,;\"'}\])]+)",
            re.IGNORECASE,
        ),
        rf"\g<keep>{MASKED}",
    ),
    (re.compile(rf"(?P<keep>-[\w-]{{0,40}}{_WORD}[\w-]{{0,40}}\s{{1,9}})(?!-)[^\s]+",
                re.IGNORECASE),
     rf"\g<keep>{MASKED}"),
)  # fmt: skip
_SECRET_VARIABLE = re.compile(rf"{_WORD}|KEY$", re.IGNORECASE)
_NO_NAMES = frozenset(
    {"root", "user", "admin", "operator", "station", "service", "ocmm", "demo", "nobody", "home"}
)
"""Account names that are not names of people."""
_HONORIFICS = frozenset({"und", "and", "von", "van", "der", "den", "the", "ing", "dipl", "prof"})


@dataclass(frozen=True, slots=True)
class Cleaner:
    """Remove secrets and names from texts."""

    secrets: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    """Names of people; empty to keep them."""

    def clean(self, text: str) -> str:
        # Whole keys first: masking a line of one would hide its start.
        text = _PATTERNS[0][0].sub(_PATTERNS[0][1], text)
        for secret in sorted(self._forms(), key=len, reverse=True):
            text = text.replace(secret, MASKED)
        for pattern, instead in _PATTERNS[1:]:
            text = pattern.sub(instead, text)
        for name, instead in self._masks():
            text = re.sub(rf"(?<![^\W_]){re.escape(name)}(?![^\W_])", instead, text,
                          flags=re.IGNORECASE)  # fmt: skip
        return text

    def clean_bytes(self, content: bytes) -> bytes:
        """Clean a text of any encoding; bytes that are not UTF-8 become escapes."""
        return self.clean(content.decode("utf-8", errors="backslashreplace")).encode()

    def _forms(self) -> set[str]:
        """Return the secrets as they can occur in a log: also URL-quoted and in JSON."""
        found = set()
        for secret in self.secrets:
            if len(secret) >= _LEAST_SECRET:
                in_json = secret.replace("\\", "\\\\").replace('"', '\\"')
                found |= {secret, quote(secret, safe=""), quote(secret), unquote(secret), in_json}
        return {one for one in found if len(one) >= _LEAST_SECRET}

    def _masks(self) -> list[tuple[str, str]]:
        """Return the replacement of each name and each of its parts, longest first."""
        masks: dict[str, str] = {}
        for number, name in enumerate(dict.fromkeys(self.names), start=1):
            for part in (name, *re.split(r"[\s,.;/]+", name)):
                small = part.casefold()
                if len(part) >= _LEAST_NAME and small not in _NO_NAMES | _HONORIFICS:
                    masks.setdefault(part, f"[person {number}]")
        return sorted(masks.items(), key=lambda mask: len(mask[0]), reverse=True)


def secrets_in(texts: Iterable[str], environment: Mapping[str, str]) -> tuple[str, ...]:
    """Return the values of secrets: contents of secret files, and values of secret variables."""
    found: dict[str, None] = {}
    for text in texts:
        for part in (text, text.strip(), *text.split()):
            if part.strip():
                found.setdefault(part)
    for name, value in environment.items():
        if _SECRET_VARIABLE.search(name) and value.strip() and "/" not in value[:1]:
            found.setdefault(value)
    # Words of a private key's frame occur in every text about keys.
    frame = {"PRIVATE", "BEGIN", "RSA", "EC"}
    return tuple(one for one in found if one not in frame and not one.endswith("-----"))


CONTENTS = "CONTENTS.txt"


@dataclass(frozen=True, slots=True)
class BundleItem:
    """A file exactly as it will be in the bundle."""

    part: str
    name: str
    """`part`, `name`: Name of the part, and file name in the archive."""
    content: bytes
    is_text: bool

    def preview(self, most: int = 1 << 20) -> str:
        if not self.is_text:
            return f"{self.name}: {len(self.content)} bytes of raw spots (ocmm.recording)"
        return self.content[:most].decode("utf-8", errors="backslashreplace")


@dataclass(frozen=True, slots=True)
class BundleDraft:
    """Contents of a bundle before it is written."""

    items: tuple[BundleItem, ...]
    missing: dict[str, str]
    """Why a part has no files, by its name."""
    masked: bool
    """Names of people were removed."""

    def items_of(self, part: str) -> tuple[BundleItem, ...]:
        return tuple(item for item in self.items if item.part == part)

    def packed(self, without: Collection[str] = ()) -> bytes:
        """Return the archive without some parts; InputError if a part is unknown."""
        unknown = sorted(set(without) - {spec.name for spec in PARTS})
        if unknown:
            raise InputError(
                "support.part",
                f"There is no part '{unknown[0]}' of a support bundle.",
                f"Choose from: {', '.join(spec.name for spec in PARTS)}.",
            )
        kept = [item for item in self.items if item.part not in without]
        stream = io.BytesIO()
        with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr(CONTENTS, self.contents(without))
            for item in kept:
                archive.writestr(item.name, item.content)
        return stream.getvalue()

    def contents(
        self, without: Collection[str] = (), tr: Callable[[str], str] = lambda text: text
    ) -> str:
        """Return the list of included and missing parts; ``tr`` translates it for the reader."""
        lines = [
            tr(f"OCMM support bundle, {datetime.now(UTC).isoformat(timespec='seconds')}"),
            tr("Passwords, tokens and private keys were taken out."),
            tr("Names of people were masked." if self.masked else "Names of people were kept."),
            "",
        ]
        for spec in PARTS:
            items = () if spec.name in without else self.items_of(spec.name)
            why = "Left out." if spec.name in without else self.missing.get(spec.name, "")
            lines.append(f"{tr(spec.title)}: {tr(spec.about)}. {tr(why)}".rstrip())
            lines += [f"  {item.name}  {len(item.content)} bytes" for item in items]
        return "\n".join(lines) + "\n"


def draft_bundle(
    site: SupportSite,
    *,
    mask_names: bool,
    told: Callable[[str, float], None] = lambda title, share: None,
) -> BundleDraft:
    """Collect all parts and remove secrets and, with ``mask_names``, names of people."""
    loaded = site.store.load()
    secrets = secrets_in(secret_texts(loaded), site.environment)
    cleaner = Cleaner(secrets, names_of(loaded, site) if mask_names else ())
    items: list[BundleItem] = []
    missing: dict[str, str] = {}
    for number, spec in enumerate(PARTS):
        told(spec.title, number / len(PARTS))
        found, why = taken(spec, site, loaded)
        if why:
            missing[spec.name] = cleaner.clean(why)
        for raw in found:
            content = cleaner.clean_bytes(raw.content) if raw.is_text else raw.content
            items.append(BundleItem(spec.name, cleaner.clean(raw.name), content, raw.is_text))
    return BundleDraft(tuple(items), missing, mask_names)


def write_bundle(draft: BundleDraft, path: Path, without: Collection[str] = ()) -> int:
    """Write the archive, return bytes; InputError for a wrong part or name; StorageError."""
    if path.suffix.lower() != ".zip":
        raise InputError(
            "support.name", f"{path}: a support bundle is a .zip file.", "Give a name in .zip."
        )
    content = draft.packed(without)
    write_atomic(path, content)
    return len(content)


@dataclass(frozen=True, slots=True)
class AboutLine:
    title: str
    value: str


@dataclass(frozen=True, slots=True)
class AboutDocument:
    title: str
    text: Callable[[], str]


DOCUMENTS = (
    AboutDocument(title="Licence", text=lambda: shipped_text("LICENSE")),
    AboutDocument(
        title="Third-party licences", text=lambda: shipped_text("THIRD_PARTY_LICENCES.md")
    ),
    AboutDocument(title="Changes", text=lambda: "\n".join(changes_since())),
)
"""In the order of the page."""


def about_lines(site: SupportSite) -> tuple[AboutLine, ...]:
    """Return version, commit, licence and folders, for the page and for a message to support."""
    build, store = this_build(), site.store
    cameras, probes = site.records
    commit = (
        AboutLine(title="Commit", value=build.commit),
        AboutLine(title="Date of the commit", value=build.date),
        AboutLine(title="Sources", value="changed since" if build.changed else "as in the commit"),
    )
    return (
        AboutLine(title="Version", value=build.version),
        *(commit if build.commit else ()),
        AboutLine(title="Python", value=f"{platform.python_version()}, {platform.platform()}"),
        AboutLine(title="Licence", value="MIT"),
        AboutLine(title="Jobs", value=str(store.load().settings.job_folder.absolute())),
        AboutLine(title="Your settings", value=str(store.user.path)),
        AboutLine(title="Settings of the station", value=str(store.station.path)),
        AboutLine(title="Calibrations", value=str(cameras)),
        AboutLine(title="Probes", value=str(probes)),
        AboutLine(title="Logs", value=str(site.logs)),
    )
