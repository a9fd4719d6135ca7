"""Collect the sentences of the core for translation, and say what the languages lack.

``python -m docs.make_core_texts`` reads the sources and writes ``resources/i18n/core.json``: every
sentence that the core can say to a person, with names in braces for what is filled in, and the
codes of the errors that say it. It renews ``core_de.json``, empty where a sentence is new, and
lists what is to be done there (decision 47).
"""

from __future__ import annotations

import json
import re
import string
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

from docs.core_sentences import Reader
from ocmm_core.calibration.records import CalibrationStatus
from ocmm_core.wording import LANGUAGES

ROOT = Path(__file__).resolve().parents[1]
TEXTS = ROOT / "resources" / "i18n"

CORE = (
    "ocmm_core", "ocmm_boards", "ocmm_cad", "ocmm_genicam", "ocmm_trackers", "ocmm_machine",
    "ocmm_planner", "ocmm_shop", "ocmm_serve", "ocmm_sim",
)  # fmt: skip
REPORTS = "ocmm_gui/reports"
"""All its texts and those of the core are collected."""
ERRORS_ONLY = (
    "ocmm_gui", "ocmm_cli", "ocmm_bench", "ocmm_core/units",
    "ocmm_sim/bus/", "ocmm_sim/calibration_scenes/",
    "ocmm_sim/firmware.py", "ocmm_sim/genicam/",
    "ocmm_sim/hand/", "ocmm_sim/scene/", "ocmm_sim/slave/", "ocmm_sim/trackers/",
    "ocmm_core/export/certificate/_artefact.py",
    # Files for controls, whose comments are ASCII.
    "ocmm_machine/_dialects.py",
)  # fmt: skip
"""Only what is raised with a code, and what a command says by `say`: sentences of the window have
`tr`, help stays English; units and the words of certificates are patterns."""
COMMANDS = ("ocmm_cli", "ocmm_bench")
LEFT_OUT = (
    # Words that other programs read.
    *(
        f"ocmm_core/export/qif/_{one}.py"
        for one in ("characteristics", "check", "qif", "writer")
    ),
    "ocmm_core/export/aqdef", "ocmm_core/export/certificate/_dcc.py",
    "ocmm_core/export/report/_json_schema.py", "ocmm_core/export/report/_polyworks.py",
    "ocmm_core/export/report/_first_article.py", "ocmm_cad/point_files.py",
    # For makers of cameras: the rules of a conforming one, by the words of the ETG.
    "ocmm_bench/conform",
    # Documents of the cameras, in English as the ETG wants them.
    "ocmm_core/fieldbus/device/_camera_", "ocmm_core/fieldbus/device/_object_",
    "ocmm_core/fieldbus/device/_profile_objects.py", "ocmm_sim/slave/_esi.py",
    # Help of commands, which stays English.
    "ocmm_core/options.py",
    # Texts of the protocol, and a table of the English manual.
    "ocmm_serve/ippdme/_commands.py", "ocmm_serve/ippdme/_grammar.py",
    "ocmm_serve/ippdme/_registry.py",
    # Names of functions, of files, and patterns.
    "ocmm_cli/_kernels.py", "ocmm_core/cleanup.py",
)  # fmt: skip

COMPOSED = (
    # Texts joined from words at run time.
    "{count:n} of {total:n} {verdict:k}", "{count:n} {verdict:k}",
    "{count:n} {verdict:k}, {count_2:n} {verdict_2:k}",
    "{count:n} {verdict:k}, {count_2:n} {verdict_2:k}, {count_3:n} {verdict_3:k}",
    "upright",
    # With its place: a camera can be called "left".
    "at the equator, left", "at the equator, right",
    "at the equator, front", "at the equator, back",
    "{polar:n} degrees below the pole, left", "{polar:n} degrees below the pole, right",
    "{polar:n} degrees below the pole, front", "{polar:n} degrees below the pole, back",
    *(
        f"{word} {{identity}}{due}"
        for word in (*CalibrationStatus, "UNCALIBRATED")
        for due in ("", " due {date}")
    ),
    "NOT CONFORM: {names}", "NOT PROVEN: {names}", "INCOMPLETE: {names}", "NOT MEASURED: {names}",
    "PARTIAL PLAN: {sentence:s}.",
    # Places of an acceptance test.
    "sphere {number:n}", "repeat {number:n}", "across", "bed",
    "along {axis}", "leaning {number:n}", "measurement {number:n}",
    "{sentence:s}, again", "5 attitudes, {depth_part:w}", "{count:n} placements",
    # Cells of the volume that lack poses.
    *(
        f"Missing probe poses: {', '.join(f'{{cell_{one}:s}}' for one in range(count))}{more}."
        for count, more in ((1, ""), (2, ""), (3, ""), (3, " and {more:n} more"))
    ),
    *(
        f"{depth} {height} {side}"
        for depth in ("near", "middle", "far")
        for height in ("low", "mid-height", "high")
        for side in ("left", "centre", "right")
    ),
    *(
        f"{place}, {lean}"
        for place in ("near third", "middle third", "far third")
        for lean in (
            "upright", "leaning right", "leaning left", "leaning away", "leaning near"
        )
    ),
)  # fmt: skip

TITLES = (
    # From an excluded package, but the window shows its title.
    "QIF 3.0 results", "First article (AS9102)", "Point cloud (XYZ, ASC, PLY)",
    "Points with U (JSON, Parquet)",
    # Kinds of sources of a plan.
    "model", "QIF document", "table", "sources",
    # Placements of a bar.
    "level", "at 45°",
    # As fits are named, and with the symbols of ISO 14405-1.
    "inscribed", "circumscribed",
    "least squares (GG)", "minimum zone (GC)", "inscribed (GX)", "circumscribed (GN)",
    "two-point maximum (LP SX)", "two-point minimum (LP SN)", "two-point mean (LP SA)",
    # The scale of the whiskers, which a report draws in its language.
    "Deviation from the middle of the zone, × {factor:g}", "lower limit", "upper limit",
    "{count} too much", "{count} too little", "{count} accepted", "{count} within, not accepted",
    "{count} held back", "Colour: between points, to {reach:.1f} mm. Grey: not measured.",
)  # fmt: skip
"""Words that no source has as one."""

_DOCUMENTS = [
    tomllib.loads(path.read_text(encoding="utf-8"))
    for path in sorted((ROOT / "resources" / "acceptance").glob("*.toml"))
]
_SOURCES = sorted(
    {
        f"{one['standard']}{':' if one['edition'].isdigit() else ', '}{one['edition']}"
        for one in _DOCUMENTS
        if re.search("[a-z]{2}", one["standard"])
    }
)
PROCEDURES = (
    *(one["title"] for one in _DOCUMENTS),
    *(f"{start}{name}" for name in _SOURCES for start in ("", "tested to ", "modelled on ")),
    *(
        need["lost"]
        for path in sorted((ROOT / "resources" / "genicam").glob("*.toml"))
        for need in tomllib.loads(path.read_text(encoding="utf-8")).get("needs", ())
    ),
)
"""Titles of the shipped procedures, sources whose names have words, and what cameras lack."""

WORD_FILES = re.compile(
    r"_steps|_procedure_\w+|acceptance/_guided|settings/_specs|_facts|_paper_facts|_report_data|_head"
    r"|_tables|_recall_messages|_causes|_registry|_calibration_choice|_gauge_rr|_from_jobs|_in_use"
    r"|screen/_snapshot|_model_frame|_job_messages|_usable|certificate/_content|_contributions|_evaluating|_kinds"
)
"""Fields whose single words are headings or titles of steps."""


@dataclass(frozen=True, slots=True)
class Texts:
    """What the core can say to a person, in English.

    Attributes
    ----------
    sentences
        Each with the codes of the errors that say it.
    words
        Members of enumerations, names of kinds and shapes; they are filled into sentences.
    remedies
        Those of the sentences that say what to do about an error.
    """

    sentences: dict[str, list[str]]
    words: list[str]
    remedies: list[str]


def collect(root: Path = ROOT) -> Texts:
    """Read the sources."""
    found: dict[str, set[str]] = {sentence: set() for sentence in (*COMPOSED, *PROCEDURES)}
    words = set(TITLES)
    remedies: set[str] = set()
    for path in sorted(
        p for room in (*CORE, *COMMANDS, "ocmm_gui") for p in (root / room).rglob("*.py")
    ):
        name = path.relative_to(root).as_posix()
        if name.startswith(LEFT_OUT):
            continue
        all_of_it = name.startswith(REPORTS) or not name.startswith(ERRORS_ONLY)
        reader = Reader(
            path.read_text(encoding="utf-8"), of_command=not name.startswith("ocmm_gui")
        )
        for sentence, code, is_remedy in reader.sentences(all_of_it=all_of_it):
            codes = found.setdefault(sentence, set())
            if code:
                codes.add(code)
            if is_remedy:
                remedies.add(sentence)
        for sentence in reader.failures():
            found.setdefault(sentence, set())
        if name.startswith(CORE) and not name.startswith(ERRORS_ONLY):
            words.update(
                reader.words(single=bool(WORD_FILES.search(name)), names="tolerances/kinds" in name)
            )
        elif name.startswith(COMMANDS):
            words.update(reader.spoken_words())
    sentences = {sentence: sorted(found[sentence]) for sentence in sorted(found)}
    return Texts(sentences, sorted(words), sorted(remedies))


def faults(texts: Texts, shown: Shown) -> list[str]:
    """Return the faults of the catalogue of a language, one line each."""
    found = [f"not translated: {one!r}" for one in texts.sentences if not shown.sentences.get(one)]
    found += [f"nobody says: {one!r}" for one in shown.sentences if one not in texts.sentences]
    for said, told in shown.sentences.items():
        try:
            if told and fields(said) != fields(told):
                found.append(f"other names than {said!r}: {told!r}")
        except ValueError:
            found.append(f"braces that do not close: {told!r}")
    found += [f"no such word: {one!r}" for one in texts.words if not shown.words.get(one)]
    return found


def fields(sentence: str) -> frozenset[str]:
    """Return the names in a sentence."""
    return frozenset(name for _, name, *_ in string.Formatter().parse(sentence) if name is not None)


@dataclass(frozen=True, slots=True)
class Shown:
    """The catalogue of a language: English to translated."""

    sentences: dict[str, str]
    words: dict[str, str]


def load_shown(language: str) -> Shown:
    """Return the catalogue of a language as it is stored."""
    path = TEXTS / f"core_{language}.json"
    stored = json.loads(path.read_text(encoding="utf-8"))
    return Shown(stored["sentences"], stored["words"])


def renewed(texts: Texts, shown: Shown) -> Shown:
    """Return a catalogue with all present texts, empty for new ones, without unused ones."""
    # Words also contain messages of the system, such as "Permission denied": they stay.
    words = {one: shown.words.get(one, "") for one in {*texts.words, *shown.words}}
    return Shown(
        {one: shown.sentences.get(one, "") for one in texts.sentences},
        {one: words[one] for one in sorted(words)},
    )


def catalogue(sentences: object, words: object, **more: object) -> str:
    """Return a catalogue as it is stored: one line a sentence, so that changes can be read."""
    stored = {"sentences": sentences, "words": words, **more}
    return json.dumps(stored, ensure_ascii=False, indent=0) + "\n"


def main() -> None:
    """Renew the catalogues; the exit code is 1 if a language lacks something."""
    texts = collect()
    (TEXTS / "core.json").write_text(
        catalogue(texts.sentences, texts.words, remedies=texts.remedies), encoding="utf-8"
    )
    sys.stdout.write(f"{len(texts.sentences)} sentences, {len(texts.words)} words\n")
    left = 0
    for language in LANGUAGES[1:]:
        shown = renewed(texts, load_shown(language))
        path = TEXTS / f"core_{language}.json"
        path.write_text(catalogue(shown.sentences, shown.words), encoding="utf-8")
        told = faults(texts, shown)
        left += len(told)
        sys.stdout.write("".join(f"{path.name}: {line}\n" for line in told))
    sys.exit(1 if left else 0)


if __name__ == "__main__":
    main()
