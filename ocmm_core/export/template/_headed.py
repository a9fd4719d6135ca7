"""Report sheet of every report: the template of this station, and data given with a job.

All routes (the window, `ocmm measure`, `ocmm report`, a key during a job) get the same sheet: the
template is stored once, with its logo, in the folder of this user; customer, order, drawing and the
like are stored next to the job file, which is sealed and not changed. Ambient readings in the job
have priority over those given with the report. The head is the one of the settings.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
import tomllib
from collections.abc import Set as AbstractSet
from dataclasses import fields, replace
from pathlib import Path

import msgspec
import platformdirs

from ocmm_core.ambient import QUANTITIES, reading_of
from ocmm_core.documents import LARGEST_DOCUMENT, decode_json, read_bytes, read_text, write_atomic
from ocmm_core.errors import InputError, StorageError
from ocmm_core.export.template._template import Paper, Particulars, load_paper, standard_template
from ocmm_core.seals import release_path
from ocmm_core.settings import Settings, toml_text
from ocmm_core.wording import LANGUAGES, language_of

_SAID = {
    "room": lambda reading: f"Room {reading}.",
    "humidity": lambda reading: f"Humidity {reading}.",
    "pressure": lambda reading: f"Air pressure {reading}.",
}
"""Sentence of each quantity, by its field."""


def ambient_conditions(
    given: Particulars, known: AbstractSet[str] = frozenset()
) -> tuple[str, ...]:
    """Return the ambient readings, a sentence each, without missing ones.

    `known`: fields in a record, which override the given ones. Raises InputError if a field is no
    reading, has another unit, or an implausible number.
    """
    asked = [one for one in QUANTITIES if one.field not in known]
    read = [(one.field, reading_of(one, getattr(given, one.field))) for one in asked]
    return tuple(_SAID[field](found.words) for field, found in read if found is not None)


PARTICULARS_SCHEMA = "ocmm.report-particulars/1"
BESIDE = ".paper.json"
"""Suffix to the name of a job file."""

_LARGEST = 1 << 16
_LONGEST = 1000
_MOST_SENTENCES = 20


class _Kept(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    schema: str
    given: Particulars


def station_template() -> Path:
    """Return the path of this station's template, which may not exist."""
    return platformdirs.user_data_path("ocmm") / "reports" / "template.toml"


def template_in_use() -> Path:
    kept = station_template()
    return kept if kept.exists() else standard_template()


def keep_template(path: Path) -> Path:
    """Store a template with its logo for this station; InputError: unusable; StorageError."""
    paper, kept = load_paper(path), station_template()
    if path.resolve() == kept.resolve():
        return kept
    content = read_text(path).encode("utf-8")
    logo = paper.template.laboratory.logo
    if logo.casefold() == kept.name:
        raise InputError(
            "report.template",
            f"{path}: field 'laboratory.logo' has the name of the template itself.",
            "Give the picture another name.",
        )
    try:
        kept.parent.mkdir(parents=True, exist_ok=True)
        if logo:
            # First: a template without its logo would be refused.
            write_atomic(kept.with_name(logo), paper.logo)
        write_atomic(kept, content)
        beside = release_path(path)
        if beside.is_file():
            write_atomic(release_path(kept), read_text(beside).encode("utf-8"))
        else:
            release_path(kept).unlink(missing_ok=True)
    except OSError as error:
        raise _unwritable(kept, error) from error
    return kept


def given_with(job: Path) -> Particulars:
    """Return the data stored with a job, empty without any; InputError if malformed."""
    path = _beside(job)
    if not path.exists():
        return Particulars()
    try:
        kept = decode_json(read_bytes(path, _LARGEST), _Kept)
    except (InputError, ValueError, RecursionError) as error:
        raise _unreadable(path, str(error)) from error
    if kept.schema != PARTICULARS_SCHEMA:
        raise _unreadable(path, f"its schema is {kept.schema!r}")
    return kept.given


def keep_given(job: Path, given: Particulars) -> Path:
    """Store data next to the file of a job; return the path.

    The number of a report is not stored, as it belongs to one report. InputError: a text is too
    long, or an ambient reading is invalid. StorageError: it cannot be stored.
    """
    _require_short(given)
    path = _beside(job)
    kept = _Kept(schema=PARTICULARS_SCHEMA, given=replace(given, number=""))
    content = msgspec.json.format(msgspec.json.encode(kept), indent=1) + b"\n"
    try:
        write_atomic(path, content)
    except OSError as error:
        raise _unwritable(path, error) from error
    return path


def paper_of(job: Path, given: Particulars | None = None, template: Path | None = None) -> Paper:
    """Return the report sheet of a job.

    `given`: overrides data stored with the job, field by field. `template`: default: that of this
    station, else the plain one. InputError: template, or data stored with the job, cannot be used.
    """
    kept = given_with(job)
    if given is not None:
        _require_short(given)
    asked = {
        one.name: getattr(given, one.name)
        for one in fields(Particulars)
        if given is not None and getattr(given, one.name)
    }
    return load_paper(template or template_in_use(), replace(kept, **asked))


def _beside(job: Path) -> Path:
    return job.with_name(job.name + BESIDE)


def _require_short(given: Particulars) -> None:
    for one in fields(Particulars):
        value = getattr(given, one.name)
        texts = (value,) if isinstance(value, str) else value
        if len(texts) > _MOST_SENTENCES or any(len(text) > _LONGEST for text in texts):
            raise InputError(
                "report.given_long",
                f"'{one.name}' is too long for a paper; at most {_LONGEST} characters, and "
                f"{_MOST_SENTENCES} sentences.",
                "Shorten it.",
            )
    ambient_conditions(given)


def _unreadable(path: Path, why: str) -> InputError:
    return InputError(
        "report.given",
        f"{path}: what was kept for the report of this job cannot be read ({why}).",
        "Delete that file and give customer, order and drawing again.",
    )


def _unwritable(path: Path, error: OSError) -> StorageError:
    return StorageError(
        "report.keep",
        f"{path}: it cannot be written ({error.strerror or error}).",
        "Free the disk or choose another folder; the report itself is not affected.",
    )


_FOLDER = "report-head"
_LARGEST_LOGO = 4 << 20


def use_head(settings: Settings, folder: Path) -> Path | None:
    """Use the head of the settings for every report of this station.

    Laboratory, logo, machine, place, signatures, language and unit are put into the template of the
    settings, or into the current one, and the result is stored for every route to a report
    (`keep_template`). Without such settings the current template is unchanged, and None is
    returned. `folder`: for the template with its head and logo. InputError: the template or the
    logo cannot be used. StorageError: it cannot be written.
    """
    path = _written_head(settings, folder / _FOLDER)
    if path is None:
        base = settings.report_template
        return None if base is None else keep_template(base)
    return keep_template(path)


def headed_paper(settings: Settings) -> Paper:
    """Return the report sheet by the settings, for a preview; errors as `use_head`."""
    with tempfile.TemporaryDirectory(prefix="ocmm-head-") as scratch:
        path = _written_head(settings, Path(scratch))
        return load_paper(path or settings.report_template or template_in_use())


def _written_head(settings: Settings, made: Path) -> Path | None:
    """Write the template with its head, and return its path; None without settings."""
    source = settings.report_template or template_in_use()
    paper = load_paper(source)
    language = _language(settings)
    said = {key: value for key, value in _said(settings).items() if value}
    # The unit of reports, by their setting or that of the window.
    lengths = settings.report_units
    if lengths == "window":
        lengths = settings.window_units
    told = (paper.template.language, paper.template.lengths)
    if not (said or settings.report_logo) and (language, lengths) == told:
        return None
    data = tomllib.loads(read_text(source, LARGEST_DOCUMENT))
    data["language"], data["lengths"] = language, lengths
    laboratory = data.setdefault("laboratory", {})
    for (part, name), value in said.items():
        (data.setdefault(part, {}) if part else data)[name] = value
    logo, suffix = paper.logo, Path(laboratory.get("logo", "")).suffix
    if settings.report_logo is not None:
        logo, suffix = read_bytes(settings.report_logo, _LARGEST_LOGO), settings.report_logo.suffix
    if logo:
        # Named by its hash: a concurrent report reads one version or the other.
        laboratory["logo"] = f"logo-{hashlib.sha256(logo).hexdigest()[:12]}{suffix}"
    text = toml_text(data).encode("utf-8")
    path = made / f"head-{hashlib.sha256(text).hexdigest()[:12]}.toml"
    try:
        made.mkdir(parents=True, exist_ok=True)
        if logo:
            write_atomic(made / laboratory["logo"], logo)
        write_atomic(path, text)
        load_paper(path)
    except OSError as error:
        raise StorageError(
            "report.head",
            f"{made}: the head of the report cannot be written ({error.strerror}).",
            "Give this user the right to write there; reports have the plain head until then.",
        ) from error
    return path


def _said(settings: Settings) -> dict[tuple[str, str], str | list[str]]:
    """Return the template fields of the settings, by part and field; empty ones are omitted."""
    return {
        ("laboratory", "name"): settings.report_laboratory,
        ("laboratory", "address"): list(settings.report_address),
        ("laboratory", "contact"): settings.report_contact,
        ("laboratory", "accreditation"): settings.report_accreditation,
        ("laboratory", "country"): settings.report_country,
        ("machine", "name"): settings.report_machine,
        ("machine", "serial"): settings.report_machine_serial,
        ("machine", "inventory"): settings.report_machine_inventory,
        ("", "place"): settings.report_place,
        ("", "signatures"): list(settings.report_signatures),
    }


def _language(settings: Settings) -> str:
    """Return the language of reports: by setting, or that of the window, or of the system."""
    chosen = settings.report_language
    if chosen == "window":
        chosen = settings.window_language
    return chosen if chosen in LANGUAGES else language_of(os.environ)
