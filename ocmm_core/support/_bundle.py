"""Support bundle: collect, show, then write. Nothing is sent."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Collection
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from ocmm_core.documents import write_atomic
from ocmm_core.errors import InputError
from ocmm_core.support._clean import Cleaner, secrets_in
from ocmm_core.support._parts import PARTS, SupportSite, names_of, secret_texts, taken

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

    def of(self, part: str) -> tuple[BundleItem, ...]:
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
        self, without: Collection[str] = (), say: Callable[[str], str] = lambda text: text
    ) -> str:
        """Return the list of included and missing parts; ``say`` translates it for the reader."""
        lines = [
            say(f"OCMM support bundle, {datetime.now(UTC).isoformat(timespec='seconds')}"),
            say("Passwords, tokens and private keys were taken out."),
            say("Names of people were masked." if self.masked else "Names of people were kept."),
            "",
        ]
        for spec in PARTS:
            items = () if spec.name in without else self.of(spec.name)
            why = "Left out." if spec.name in without else self.missing.get(spec.name, "")
            lines.append(f"{say(spec.title)}: {say(spec.about)}. {say(why)}".rstrip())
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
