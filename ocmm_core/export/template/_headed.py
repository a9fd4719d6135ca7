"""Report template with the head of the settings."""

from __future__ import annotations

import hashlib
import os
import tempfile
import tomllib
from pathlib import Path

from ocmm_core.documents import LARGEST_DOCUMENT, read_bytes, read_text, write_atomic
from ocmm_core.errors import StorageError
from ocmm_core.export.template._papers import keep_template, template_in_use
from ocmm_core.export.template._template import Paper, load_paper
from ocmm_core.settings import Settings, toml_text
from ocmm_core.wording import LANGUAGES, language_of

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
    lengths = _lengths(settings)
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


def _lengths(settings: Settings) -> str:
    """Return the unit of reports: by setting, or that of the window."""
    return settings.window_units if settings.report_units == "window" else settings.report_units


def _language(settings: Settings) -> str:
    """Return the language of reports: by setting, or that of the window, or of the system."""
    chosen = settings.report_language
    if chosen == "window":
        chosen = settings.window_language
    return chosen if chosen in LANGUAGES else language_of(os.environ)
