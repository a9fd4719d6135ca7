"""Report sheet of every report: the template of this station, and data given with a job.

All routes (the window, `ocmm measure`, `ocmm report`, a key during a job) get the same sheet: the
template is stored once, with its logo, in the folder of this user; customer, order, drawing and the
like are stored next to the job file, which is sealed and not changed.
"""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

import msgspec
import platformdirs

from ocmm_core.documents import decode_json, read_bytes, read_text, write_atomic
from ocmm_core.errors import InputError, StorageError
from ocmm_core.export.template._surroundings import surroundings
from ocmm_core.export.template._template import Paper, Particulars, load_paper, standard_template
from ocmm_core.seals import release_path

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
    surroundings(given)


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
