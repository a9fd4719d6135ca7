"""An independent reader of Q-DAS files, by the published table of K-fields: it discards nothing.

The reader shares no code with the product. Like a program for statistics it discards fields with an
unknown key, a wrong type or excess length, and numbers that refer to no entry of their catalogue.
"""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from pathlib import Path

import msgspec
import pytest

from ocmm_core.errors import StorageError
from ocmm_core.export import write_report
from ocmm_core.export.aqdef._head import KEYS, fitted
from ocmm_core.export.report import ReportData
from ocmm_core.export.template import Particulars, load_paper, standard_template
from ocmm_core.inspection.evaluation import JobHeader
from ocmm_core.inspection.plan import Plan
from ocmm_core.tolerances.decisions import Verdict
from tests.core.export.sample_report import HEAD, result, sample_report, sample_view

# Hexagon, Q-DAS configurator, "Supported K-Fields": key, type, length. The catalogues are those of
# public readers of the format (part of the catalogue: number, name).
TABLE = {
    line.split()[0]: (line.split()[1], int(line.split()[2]))
    for line in """
    K0001 F 22
    K0002 I 5
    K0004 D 19
    K0005 S 255
    K0006 AN 14
    K0007 I 10
    K0008 I 10
    K0009 AN 255
    K0010 I 10
    K0011 S 255
    K0012 I 10
    K0014 AN 40
    K0053 AN 20
    K0100 I 5
    K1001 AN 30
    K1002 AN 80
    K1041 AN 30
    K1042 AN 20
    K1053 AN 40
    K1062 AN 40
    K1081 AN 24
    K1082 AN 40
    K1201 AN 24
    K1202 AN 40
    K1222 AN 40
    K1230 AN 40
    K1341 AN 20
    K1342 AN 40
    K1900 AN 255
    K2001 AN 20
    K2002 AN 80
    K2004 I 5
    K2009 I 5
    K2022 I 5
    K2101 F 22
    K2110 F 22
    K2111 F 22
    K2112 F 22
    K2113 F 22
    K2120 I 3
    K2121 I 3
    K2142 AN 20
    K2401 AN 40
    K2402 AN 80
    K2900 AN 255
    K4062 AN 40
    K4072 AN 40
    K4073 AN 80
    K4092 AN 50
    """.strip().splitlines()
}
CATALOGUES = {"K0008": "K4092", "K0010": "K4062", "K0012": "K4072"}
ORDER = [
    "K0001", "K0002", "K0004", "K0005", "K0006", "K0007", "K0008", "K0010", "K0011", "K0012",
]  # fmt: skip


class Reader:
    """Kept and discarded fields."""

    def __init__(self, content: bytes) -> None:
        self.kept: dict[tuple[str, int], str] = {}
        self.values: list[list[dict[str, str]]] = []
        self.discarded: list[str] = []
        for line in content.decode("cp1252").split("\r\n"):
            if "\x14" in line:
                self.values.append([self._value(part) for part in line.split("\x0f")])
            elif line:
                place, text = line.split(" ", 1)
                key, _, index = place.partition("/")
                if self._fits(key, text):
                    self.kept[key, int(index or 0)] = text
                else:
                    self.discarded.append(line)

    def _value(self, part: str) -> dict[str, str]:
        found = {}
        for key, text in zip(ORDER, part.split("\x14"), strict=True):
            told = text.removeprefix("#") if key == "K0006" else text
            if told and not self._fits(key, told):
                self.discarded.append(f"{key} {text}")
            elif told:
                found[key] = told
        return found

    def _fits(self, key: str, text: str) -> bool:
        if key not in TABLE:
            return False
        kind, length = TABLE[key]
        if len(text) > length:
            return False
        try:
            if kind == "I":
                int(text)
            elif kind == "F":
                float(text)
            elif kind == "D":
                datetime.strptime(text, "%d.%m.%Y/%H:%M:%S")
        except ValueError:
            return False
        catalogue = CATALOGUES.get(key)
        return catalogue is None or (catalogue, int(text)) in self.kept

    def of(self, key: str, values: dict[str, str]) -> str:
        """Return the catalogue entry of a value's number."""
        return self.kept[CATALOGUES[key], int(values[key])]


def told(data: ReportData | list[ReportData], folder: Path) -> Reader:
    (path,) = write_report(data, ("dfq",), folder, incomplete=True)
    return Reader(path.read_bytes())


def with_paper(data: ReportData, given: Particulars) -> ReportData:
    return replace(data, paper=load_paper(standard_template(), given))


GIVEN = Particulars(
    customer="Customer AG", order="O-77", drawing="D-4711", revision="C", machine="Mill 3",
    place="Room 2",
)  # fmt: skip


def test_nothing_is_discarded_of_an_ordinary_job(tmp_path: Path) -> None:
    found = told(with_paper(sample_report(), GIVEN), tmp_path)
    assert found.discarded == []
    kept = {key: text for (key, index), text in found.kept.items() if index == 0}
    assert (kept["K1041"], kept["K1042"], kept["K1053"]) == ("D-4711", "C", "O-77")
    assert (kept["K1062"], kept["K1081"], kept["K1230"]) == ("Customer AG", "Mill 3", "Room 2")
    assert kept["K1341"] == "BLOCK"
    # The work cycle is not the plan, and none was given.
    assert ("K1086", 0) not in found.kept
    for values in found.values[0]:
        assert found.of("K0008", values) == HEAD.operator
        assert found.of("K0010", values) == "Mill 3"
        assert found.of("K0012", values).startswith("VALID standard/6 mm")
    assert found.kept["K2112", 1] == "-0.0100"
    assert found.kept["K2900", 1] == "diameter of BORE 1"


def test_nothing_is_discarded_of_several_jobs_with_long_texts(tmp_path: Path) -> None:
    jobs = []
    for number in range(3):
        view = replace(
            sample_view(), job=f"Block_{number}",
            header=JobHeader("x", "Block", "s", "order" * 20, f"2026-11-25-charge-{number}"),
        )  # fmt: skip
        head = replace(
            HEAD, operator=f"Wolfeschlegelsteinhausenbergerdorff {'Łukasz ' * 9}{number}",
            serial=f"{'S' * 60}{number}", part="Long " * 40,
        )  # fmt: skip
        data = sample_report(view, head=head)
        given = replace(GIVEN, drawing="D" * 99, machine=f"{'M' * 80}{number}", customer="c" * 300)
        jobs.append(with_paper(replace(data, plan=replace_plan(data)), given))
    found = told(jobs, tmp_path)
    assert found.discarded == []
    batches = {values[0]["K0006"] for values in found.values}
    # Equal beginnings are distinguished by the digits of their hash.
    assert len(batches) == 3
    assert {len(batch) for batch in batches} == {14}
    assert len({found.of("K0008", values[0]) for values in found.values}) == 3
    assert len({found.of("K0010", values[0]) for values in found.values}) == 3
    assert "drawing in full: DDD" in found.kept["K1900", 0] or found.kept["K1900", 0].endswith(
        " ..."
    )
    assert "batch in full: 2026-11-25-charge-2" in found.kept["K0009", 0]


def replace_plan(data: ReportData) -> Plan:
    return msgspec.structs.replace(data.plan, part="Part number with many letters " * 5)


def test_a_lower_limit_that_no_value_can_pass_is_a_natural_one(tmp_path: Path) -> None:
    # As in a sample of Q-DAS itself: K2110 0.000 with K2120 2 for a position.
    view = sample_view()
    form = replace(
        result("Round", 0.004, Verdict.CONFORM, kind="roundness", nominal=0.0), lower=0.0
    )
    view = replace(view, characteristics=(form,))
    found = told(sample_report(view), tmp_path)
    assert found.discarded == []
    assert (found.kept["K2120", 1], found.kept["K2121", 1]) == ("2", "1")
    assert ("K2112", 1) not in found.kept


def test_the_reader_discards_what_was_written_before(tmp_path: Path) -> None:
    (path,) = write_report(sample_report(), ("dfq",), tmp_path, incomplete=True)
    first, *others = path.read_bytes().decode("cp1252").split("\x0f")
    fields = first.split("\x14")
    fields[6] = "Zoë Müller"
    spoiled = "\x0f".join(["\x14".join(fields), *others]) + "K1086 BLOCK\r\n"
    found = Reader(spoiled.encode("cp1252"))
    assert found.discarded == ["K0008 Zoë Müller", "K1086 BLOCK"]


def test_our_table_is_the_published_one() -> None:
    assert {key: (item.type, item.length) for key, item in KEYS.items()} == {
        key: told for key, told in TABLE.items() if told[0] != "S" and key != "K0007"
    }


@pytest.mark.parametrize(
    ("key", "text", "wanted"),
    [
        ("K0006", "12345678901234", "12345678901234"),
        ("K1062", "c" * 41, "c" * 36 + " ..."),
        ("K2120", "2", "2"),
    ],
)
def test_a_text_is_kept_or_shortened_by_the_rule(key: str, text: str, wanted: str) -> None:
    assert fitted(key, text) == wanted


def test_two_long_identities_stay_two() -> None:
    first, second = fitted("K0006", "123456789012345"), fitted("K0006", "123456789012346")
    assert first != second
    assert (len(first), first[:9], first[9]) == (14, "123456789", "~")


@pytest.mark.parametrize(("key", "text"), [("K0001", "1" * 23), ("K2022", "123456"), ("K2009", "")])
def test_a_number_that_does_not_fit_is_refused(key: str, text: str) -> None:
    with pytest.raises(StorageError, match=f"does not fit the Q-DAS field {key}"):
        fitted(key, text)
