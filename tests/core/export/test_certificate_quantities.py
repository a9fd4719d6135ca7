"""The quantity of a certificate becomes the size of an artefact only if it is that size."""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Literal
from xml.sax.saxutils import escape

import numpy as np
import pytest

from ocmm_core.errors import InputError
from ocmm_core.export.certificate import artefact_text, quantities_read, read_dcc
from ocmm_core.export.certificate._artefact import Expansion
from tests.commands import Ocmm
from tests.host import amount

SIZES = {
    "diameter": ("Diameter", "Mean diameter", "Durchmesser", "Diamètre", "Ø 25", "Ball diameter"),
    "radius": ("Radius", "Halbmesser", "Kugelradius", "Rayon"),
    "length": ("Length", "Länge", "Centre distance", "Mittenabstand", "Calibrated length"),
}
OTHERS = (
    "Roundness", "Rundheitsabweichung", "Form deviation", "Sphericity", "Immersion depth",
    "Eintauchtiefe", "Nominal diameter", "Nennmaß", "Diameter deviation from nominal",
    "Measurement error of length", "Maximum permissible error", "Wavelength", "Stem diameter",
    "Roughness Rz", "Flatness", "Step height", "Width of the bar",
)  # fmt: skip
UNITS = {"\\metre": 1e3, "\\milli\\metre": 1.0, "\\micro\\metre": 1e-3}
COUNT = amount(200, 1000)
Kind = Literal["sphere", "bar"]
STEEL = Expansion(11.5e-6, 0.5e-6)


@dataclass(frozen=True)
class Stated:
    """A quantity as it was put into a certificate."""

    kind: str
    name: str
    mm: float
    expanded_mm: float
    unit: str
    k: float


def certificate(stated: list[Stated], rng: np.random.Generator, items: int = 1) -> bytes:
    """Return a foreign DCC with its uncertainties in the words of D-SI 1 or 2."""
    results = []
    for one in stated:
        scale = UNITS[one.unit]
        value, unc = one.mm / scale, one.expanded_mm / scale * one.k / 2.0
        name = f"<dcc:name><dcc:content>{escape(one.name)}</dcc:content></dcc:name>"
        outer, inner = (name, "") if rng.random() < 0.5 else ("", name)
        if rng.random() < 0.5:
            mark = (
                f"<si:expandedUnc><si:uncertainty>{unc!r}</si:uncertainty><si:coverageFactor>"
                f"{one.k}</si:coverageFactor></si:expandedUnc>"
            )
        else:
            mark = (
                "<si:measurementUncertaintyUnivariate><si:expandedMU><si:valueExpandedMU>"
                f"{unc!r}</si:valueExpandedMU><si:coverageFactor>{one.k}</si:coverageFactor>"
                "</si:expandedMU></si:measurementUncertaintyUnivariate>"
            )
        real = (
            f"<si:real><si:value>{value!r}</si:value><si:unit>{one.unit}</si:unit>{mark}</si:real>"
        )
        results.append(
            f"<dcc:result>{outer}<dcc:data><dcc:quantity>{inner}{real}"
            "</dcc:quantity></dcc:data></dcc:result>"
        )
    things = "<dcc:item/>" * items
    return (
        '<dcc:digitalCalibrationCertificate xmlns:dcc="https://ptb.de/dcc" '
        'xmlns:si="https://ptb.de/si" schemaVersion="3.2.1"><dcc:administrativeData>'
        f"<dcc:items>{things}</dcc:items></dcc:administrativeData><dcc:measurementResults>"
        f"<dcc:measurementResult><dcc:results>{''.join(results)}</dcc:results>"
        "</dcc:measurementResult></dcc:measurementResults></dcc:digitalCalibrationCertificate>"
    ).encode()


def some(rng: np.random.Generator) -> list[Stated]:
    kinds = rng.choice(["diameter", "radius", "length", "other"], rng.integers(1, 6))
    return [
        Stated(
            kind=str(kind),
            name=str(rng.choice(SIZES.get(str(kind), OTHERS))),
            mm=float(rng.uniform(5.0, 900.0)),
            expanded_mm=float(rng.uniform(1e-4, 1e-3)),
            unit=str(rng.choice(list(UNITS))),
            k=float(rng.choice([1.96, 2.0, 2.13, 3.0])),
        )
        for kind in kinds
    ]


def test_gives_the_stated_size_or_refuses() -> None:
    rng = np.random.default_rng(20261128)
    taken = 0
    for _ in range(COUNT):
        stated = some(rng)
        kind: Kind = "sphere" if rng.random() < 0.5 else "bar"
        fitting = [
            one for one in stated
            if one.kind in (("diameter", "radius") if kind == "sphere" else ("length",))
        ]  # fmt: skip
        content = certificate(stated, rng)
        if len(fitting) != 1:
            with pytest.raises(InputError, match=r"states \w+ (diameters or radii|lengths)"):
                artefact_text(read_dcc(content), kind, "2027-11-25", expansion=STEEL)
            continue
        (one,) = fitting
        text = artefact_text(read_dcc(content), kind, "2027-11-25", expansion=STEEL)
        read = tomllib.loads(text)
        size = read["diameter"] if kind == "sphere" else read["nests"][1]
        factor = 2.0 if one.kind == "radius" else 1.0
        assert size == pytest.approx(factor * one.mm, rel=1e-12)
        assert read["expanded"] == pytest.approx(factor * one.expanded_mm, rel=1e-12)
        assert ("radius, doubled" in text) == (one.kind == "radius")
        taken += 1
    assert taken > COUNT // 8


@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.parametrize("kind", ["sphere", "bar"])
def test_refuses_another_quantity_even_if_it_is_asked_for(name: str, kind: Kind) -> None:
    rng = np.random.default_rng(1)
    content = certificate([Stated("other", name, 150.0, 0.001, "\\milli\\metre", 2.0)], rng)
    with pytest.raises(InputError, match=r"\(other\)"):
        artefact_text(read_dcc(content), kind, "2027-11-25", quantity=name, expansion=STEEL)


def test_takes_a_name_without_a_known_word_only_if_asked() -> None:
    rng = np.random.default_rng(2)
    dcc = read_dcc(certificate([Stated("x", "D1", 25.0, 0.001, "\\milli\\metre", 2.0)], rng))
    with pytest.raises(InputError, match=r"D1 \(unnamed\)"):
        artefact_text(dcc, "sphere", "2027-11-25", expansion=STEEL)
    text = artefact_text(dcc, "sphere", "2027-11-25", quantity="D1", expansion=STEEL)
    assert tomllib.loads(text)["diameter"] == 25.0


def test_refuses_a_certificate_of_several_items() -> None:
    rng = np.random.default_rng(3)
    one = Stated("diameter", "Diameter", 25.0, 0.001, "\\milli\\metre", 2.0)
    with pytest.raises(InputError, match="is about 2 items"):
        artefact_text(
            read_dcc(certificate([one], rng, items=2)), "sphere", "2027-11-25", expansion=STEEL
        )


def test_each_quantity_of_a_certificate_is_printed(tmp_path: Path, ocmm_here: Ocmm) -> None:
    rng = np.random.default_rng(4)
    stated = [
        Stated("radius", "Radius", 12.5, 0.001, "\\milli\\metre", 2.0),
        Stated("other", "Roundness", 0.00012, 0.001, "\\milli\\metre", 2.0),
        Stated("other", "Immersion depth", 150.0, 0.001, "\\milli\\metre", 2.0),
    ]
    dcc = read_dcc(certificate(stated, rng))
    (read,) = quantities_read(dcc, "sphere")
    assert (read.name.endswith("Radius"), read.value) == (True, 12.5)
    assert len(dcc.quantities) == 3
    source, out = tmp_path / "ball.xml", tmp_path / "ball.toml"
    source.write_bytes(certificate(stated, rng))
    done = ocmm_here("certificate", "artefact", source, "sphere", out, "--due", "2027-11-25",
                     "--expansion", "1e-5", "--expansion-sigma", "1e-6")  # fmt: skip
    assert done.returncode == 0, done.stderr
    told = " ".join(done.stdout.split())
    assert told.count("Read: ") == 1
    for name in ("Roundness, 0.00012", "Immersion depth, 150.0"):
        assert re.search(rf"Left out: [^.]*{name}", told)
