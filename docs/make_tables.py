"""Write the tables of the documentation that say what a registry says, and schemas.

``python docs/make_tables.py`` puts each table between its marks; ``tests/core/test_docs_tables.py``
compares them.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Sequence, Set
from enum import EnumType
from functools import cache, partial
from pathlib import Path
from typing import get_args

import msgspec
from lxml import etree

from ocmm_cli.options import OPTIONS
from ocmm_core.composition import sources
from ocmm_core.doctor import CHECKS, DoctorReport
from ocmm_core.documents import write_atomic
from ocmm_core.export import FORMATS
from ocmm_core.export.report import ReportFile
from ocmm_core.features.shapes import NominalFeature
from ocmm_core.fieldbus.report import Alarm, AlarmResponse, AlarmSpec
from ocmm_core.inspection.plan import HEAD_FIELDS, EnvironmentLimits, Material, Plan
from ocmm_core.options import OF_SERVER, OF_SETTINGS, VARIABLES, WINDOW
from ocmm_core.settings import SETTINGS
from ocmm_core.tolerances.kinds import KINDS
from ocmm_core.tolerances.zones import Characteristic
from ocmm_core.typed_numbers import number_field
from ocmm_gui.plan_editor import words_of
from ocmm_serve.ippdme import DmeDialect, supported
from ocmm_serve.screen import ScreenSnapshot

ROOT = Path(__file__).resolve().parents[1]


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of Markdown."""
    lines = (head, ["---"] * len(head), *rows)
    return "\n".join(f"| {' | '.join(line)} |".replace("| --- ", "|---") for line in lines)


def alarms() -> str:
    """Return the table of the alarms of the bus."""
    return table(
        ("code", "means", "what to do", "the program"),
        (
            (f"`{one.code}`", one.title, one.remedy, _answer_words(one))
            for one in (alarm.spec for alarm in Alarm)
        ),
    )


_ANSWERS = {
    AlarmResponse.NOTE: "measures on",
    AlarmResponse.WAIT: "waits, then brings the bus up again",
    AlarmResponse.LIFT: "lifts the camera back to OP",
    AlarmResponse.REPEAT: "repeats the bring-up",
}


def _answer_words(alarm: AlarmSpec) -> str:
    if alarm.answer is AlarmResponse.BRING_UP:
        cycles = "1 cycle" if alarm.confirmed == 1 else f"{alarm.confirmed} cycles"
        return f"brings the bus up again after {cycles}"
    return _ANSWERS[alarm.answer]


def formats() -> str:
    """Return the table of the formats of a report."""
    return table(
        ("format", "in the window", "files", "for", "takes from the profile"),
        (
            (
                f"`{one.name}`",
                _plain(one.title),
                ", ".join(f"`{suffix}`" for suffix in one.suffixes),
                _plain(one.purpose),
                one.profile or "nothing",
            )
            for one in FORMATS.values()
        ),
    )


def table_of_sources() -> str:
    """Return the table of the sources of frames."""
    return table(
        ("source", "is"), ((f"`{form}`", words) for spec in sources() for form, words in spec.forms)
    )


def table_of_settings() -> str:
    """Return the table of the settings: what each is, and by what it can be set."""
    options = {one.setting: one.typed[0] for one in (*OF_SETTINGS, *OF_SERVER)}
    return table(
        ("setting", "value", "default", "option", "is"),
        (
            (
                f"`{spec.key}`",
                _value(spec.kind.value, spec.number, spec.choices),
                _default(spec.default),
                f"`{options[spec.key]}`" if spec.key in options else "",
                _plain(f"{spec.label}: {spec.tip}"),
            )
            for spec in SETTINGS
        ),
    )


def table_of_options() -> str:
    """Return the table of the options of commands."""
    rows = (
        (
            f"`{place}`" if place else "several",
            f"`{option.name.upper() if option.is_argument else ' '.join(option.typed)}`",
            _value("", option.number, option.choices),
            "required" if option.default is ... else _default(option.default),
            _plain(option.text or "as of several"),
        )
        for (place, _), option in sorted(OPTIONS.items())
    )
    return table(("command", "option", "range", "default", "is"), rows)


def table_of_window() -> str:
    """Return the table of the arguments of the window that set no setting."""
    rows = (
        (
            f"`{option.name.upper() if option.is_argument else option.typed[0]}`",
            _value("", option.number, option.choices), _default(option.default), option.text,
        )
        for option in WINDOW if not option.setting
    )  # fmt: skip
    return table(("argument", "range", "default", "is"), rows)


def variables() -> str:
    """Return the table of the environment variables."""
    rows = ((f"`{one.name}`", _default(one.default), one.text) for one in VARIABLES)
    return table(("variable", "default", "is"), rows)


def _value(kind: str, number: str, choices: Sequence[str]) -> str:
    if choices:
        return ", ".join(f"`{one}`" for one in choices)
    if not number:
        return kind
    one = number_field(number).quantity
    return f"{one.least:.10g} to {one.most:.10g} {one.unit}".strip()


def _default(value: object) -> str:
    if value is False:
        return "no"
    if value is None or value in ("", ()) or isinstance(value, dict):
        return ""
    text = "yes" if value is True else str(value)
    if isinstance(value, tuple):
        text = " ".join(map(str, value))
    if isinstance(value, Path):
        text = f"{value}".replace(f"{ROOT}/", "").replace(f"{Path.home()}", "~")
    return f"`{text}`"


def checks() -> str:
    """Return the table of the checks of the computer."""
    return table(
        ("line", "in JSON", "GREEN means"),
        ((one.title, f"`{one.name}`", one.about) for one in CHECKS),
    )


def ippdme() -> str:
    """Return the table of the commands of I++ DME."""
    every = {**supported(DmeDialect.V14), **supported(DmeDialect.V25)}
    # The public classes of the protocol; items are only arguments.
    rows = sorted(
        (one for one in every.values() if one.group != "items"), key=lambda one: one.group
    )
    return table(
        ("class", "command", "arguments", "edition", "this machine"),
        (
            (
                one.group,
                f"`{one.name}`",
                f"`{one.arguments}`" if one.arguments else "",
                "all" if len(one.dialects) > 1 else "2.5",
                _plain(one.about),
            )
            for one in rows
        ),
    )


def packages(adds: str, beside: str = "") -> str:
    """Return the table of the packages of a lock file, without those of another one."""
    from installer.licences import licences
    from installer.locks import read_lock

    pins = read_lock(ROOT / adds)
    known = licences().packages
    there = read_lock(ROOT / beside) if beside else {}
    return table(
        ("package", "version", "licence", "for"),
        (
            (name, pin.version, known[name].licence, known[name].purpose or _askers(pin.needed_by))
            for name, pin in pins.items()
            if name not in there
        ),
    )


def _askers(names: Set[str]) -> str:
    return ", ".join(sorted(names - {""})) or "tests, checks and benchmarks"


def held() -> str:
    """Return the table of foreign parts in the binaries of packages."""
    from installer.licences import licences

    return table(
        ("in the binaries of", "there is", "licence"),
        (
            (", ".join(f"`{package}`" for package in part.packages), part.name, part.licence)
            for part in licences().holds
        ),
    )


def allowed() -> str:
    """Return the table of the licences that may be in OCMM."""
    from installer.licences import licences

    known = licences()
    return table(
        ("licence", "may be in", "because"),
        (
            *((name, "everything", reason) for name, reason in known.shipped.items()),
            *((one.licence, ", ".join(one.packages), one.reason) for one in known.fits),
            *((name, "development", reason) for name, reason in known.development.items()),
        ),
    )


def fields_of(struct: type[msgspec.Struct], language: str = "en") -> str:
    """Return the table of the fields of a part of a plan, in the words of its form."""
    german = _german() if language == "de" else {}
    rows = []
    for field in msgspec.structs.fields(struct):
        if struct is Plan and field.name not in HEAD_FIELDS:
            continue
        words = words_of(struct, field.name)
        meaning = german.get(words[1], words[1])
        words_of_type = KINDS if field.name == "kind" else get_args(field.type)
        if isinstance(field.type, EnumType):
            words_of_type = [one.value for one in field.type]
        choices = [f'`"{word}"`' for word in words_of_type if isinstance(word, str) and word]
        if len(choices) > 1:
            meaning = f"{meaning}: {', '.join(choices)}"
        default = field.default
        is_text = isinstance(default, str)
        told = f'"{default}"' if is_text else str(default).lower()
        shown = "" if default in (msgspec.NODEFAULT, "", None, ()) else f"`{told}`"
        if isinstance(default, tuple) and default:
            shown = f"`{list(default)}`"
        rows.append((f"`{field.name}`", shown or ("" if not field.required else "—"), meaning))
    head = ("Feld", "Vorgabe", "Bedeutung") if german else ("field", "default", "meaning")
    return table(head, ((name, shown, _plain(meaning)) for name, shown, meaning in rows))


@cache
def _german() -> dict[str, str]:
    """Return the German of the sentences of the window."""
    tree = etree.parse(ROOT / "resources" / "i18n" / "ocmm_de.ts")
    return {
        one.findtext("source", ""): one.findtext("translation", "") for one in tree.iter("message")
    }


def _plain(text: str) -> str:
    """Return text of a cell: a bar would begin the next one."""
    return text.replace("|", "\\|")


PARTS_OF_A_PLAN: dict[str, type[msgspec.Struct]] = {
    "plan": Plan,
    "environment": EnvironmentLimits,
    "material": Material,
    "feature": NominalFeature,
    "characteristic": Characteristic,
}

_LICENCES = "THIRD_PARTY_LICENCES.md"
TABLES: dict[str, tuple[str, Callable[[], str]]] = {
    "alarms": ("docs/technician/wire.md", alarms),
    "allowed licences": (_LICENCES, allowed),
    "checks": ("docs/technician/doctor.md", checks),
    "formats": ("docs/quality/exports.md", formats),
    "ippdme": ("docs/integrator/ippdme_commands.md", ippdme),
    "packages": (_LICENCES, partial(packages, "requirements.lock")),
    "packages for development": (
        _LICENCES,
        partial(packages, "requirements-dev.lock", "requirements.lock"),
    ),
    "packages for STEP": (
        _LICENCES,
        partial(packages, "requirements-step.lock", "requirements.lock"),
    ),
    "packages for a shop": (
        _LICENCES,
        partial(packages, "requirements-shop.lock", "requirements.lock"),
    ),
    "packages for building": (
        _LICENCES,
        partial(packages, "requirements-package.lock", "requirements-dev.lock"),
    ),
    "packages for documentation": (
        _LICENCES,
        partial(packages, "requirements-docs.lock", "requirements-dev.lock"),
    ),
    "parts of packages": (_LICENCES, held),
    "options of commands": ("docs/integrator/options.md", table_of_options),
    "settings": ("docs/integrator/options.md", table_of_settings),
    "sources": ("docs/integrator/commands.md", table_of_sources),
    "variables": ("docs/integrator/options.md", variables),
    "window": ("docs/integrator/options.md", table_of_window),
    **{
        f"{name} fields{mark}": (
            f"docs{folder}/inspector/plans.md",
            partial(fields_of, struct, language),
        )
        for name, struct in PARTS_OF_A_PLAN.items()
        for mark, folder, language in (("", "", "en"), (" (de)", "/de", "de"))
    },
}
"""By the name in its marks: the page, from the root, and the text between the marks."""


SCHEMAS: dict[str, type[msgspec.Struct]] = {
    "docs/doctor.schema.json": DoctorReport,
    "docs/report.schema.json": ReportFile,
    "docs/second_screen.schema.json": ScreenSnapshot,
}
"""JSON Schemas (draft 2020-12) of the program's JSON output, from its types."""


DRAFT = "https://json-schema.org/draft/2020-12/schema"


def marked(page: str, name: str) -> re.Match[str]:
    """Return the place of a table in the text of a page, marks included."""
    pattern = (
        rf"(<!-- table {re.escape(name)}: [^\n]*-->\n)(.*?)(\n<!-- end of {re.escape(name)} -->)"
    )
    found = re.search(pattern, page, re.DOTALL)
    if found is None:
        raise LookupError(f"the marks of the table {name!r} are missing")
    return found


def schema_bytes(kind: type[msgspec.Struct]) -> bytes:
    """Return the JSON Schema of a type as its file holds it."""
    schema = {"$schema": DRAFT, **msgspec.json.schema(kind)}
    return msgspec.json.format(msgspec.json.encode(schema, order="sorted"), indent=1) + b"\n"


def main() -> None:
    """Write all tables and schemas."""
    # `installer` is next to this folder and not installed.
    sys.path.insert(0, str(ROOT))
    for name, (path, text) in TABLES.items():
        page = (ROOT / path).read_text(encoding="utf-8")
        place = marked(page, name)
        page = f"{page[: place.end(1)]}{text()}{page[place.start(3) :]}"
        write_atomic(ROOT / path, page.encode("utf-8"))
    for path, kind in SCHEMAS.items():
        write_atomic(ROOT / path, schema_bytes(kind))


if __name__ == "__main__":
    main()
