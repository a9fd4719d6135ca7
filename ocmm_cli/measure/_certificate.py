"""``ocmm certificate``: certificates of the machine, and external ones."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import msgspec
import typer

from ocmm_cli.measure._pages import print_pages
from ocmm_cli.terminal import lead, make_console, tr, tr_word
from ocmm_core.host import HOST

certificate_app = typer.Typer(
    name="certificate",
    no_args_is_help=True,
    help="Papers about cameras and tips (PDF and DCC), and certificates of artefacts.",
)


@certificate_app.command()
def make(
    folder: Path, *, calibration: bool, as_found: Path | None, tip: str, out: Path,
    template: Path | None, customer: str, place: str, humidity: str, pressure: str, pages: bool,
) -> None:  # fmt: skip
    """Write the paper of cameras, of a qualified tip, or of an acceptance test.

    A digital calibration certificate (DCC 3.2.1), signed by this station (XAdES), and pages with a
    graph. As found and after adjustment are both in it, or it says that one was not determined. It
    calls itself a calibration
    certificate only where a procedure names an accreditation.
    """
    from ocmm_core.export.certificate import certificate_of_folder, write_certificate
    from ocmm_core.export.template import Particulars, load_paper, template_in_use

    given = Particulars(customer=customer, place=place, humidity=humidity, pressure=pressure)
    sheet = load_paper(template or template_in_use(), given)
    # Before pages are drawn elsewhere, so that its error explains faulty records.
    paper = certificate_of_folder(folder, sheet, tip, calibration=calibration, as_found=as_found)
    console = make_console(soft_wrap=True)
    if not pages:
        path = write_certificate(paper, out)
        console.print(f"{lead('Certificate  ')}{path}")
        return
    options = [str(folder), "--out", str(out), "--given", msgspec.json.encode(given).decode()]
    options += ["--tip", tip] if tip else []
    options += ["--calibration"] if calibration else []
    options += ["--as-found", str(as_found)] if as_found is not None else []
    options += ["--template", str(template)] if template is not None else []
    for line in print_pages(
        "ocmm_gui.reports._certificate", [options], "certificate.pdf",
        "The certificate was not written", "With --no-pages the DCC is written without a PDF.",
    ):  # fmt: skip
        console.print(f"{lead('Certificate  ')}{line}")


@certificate_app.command()
def check(file: Path) -> None:
    """Say who signed a digital certificate, and what it states; exit code 1 without a sound one."""
    from ocmm_core.export.certificate import check_dcc_seal
    from ocmm_core.seals import KeyFolder

    found = check_dcc_seal(file, KeyFolder())
    console = make_console(soft_wrap=True)
    dcc = found.dcc
    if dcc.title:
        console.print(dcc.title)
    console.print(
        f"{dcc.number}: {dcc.laboratory}, {dcc.begin} – {dcc.end}. {tr(found.summary)}",
    )  # fmt: skip
    for one in dcc.quantities:
        unc = "" if one.expanded is None else f", U = {one.expanded:.6g} (k = {one.k:g})"
        word = f", {one.conformity}" if one.conformity else ""
        console.print(f"  {one.name}: {one.value:.9g} {one.unit}{unc}{word}")
    for name in dcc.left_out:
        console.print(f"{tr_word('Left out')}: {name}")
    if not found.sound:
        raise typer.Exit(1)


@certificate_app.command()
def artefact(
    file: Path, kind: Literal["bar", "sphere"], out: Path, *, due: str, quantity: str,
    expansion: float | None, expansion_sigma: float | None,
) -> None:  # fmt: skip
    """Write the document of a bar or a sphere from its certificate.

    Prints each quantity of the certificate: read or left out.
    """
    from ocmm_core.calibration.records import load_bar, load_sphere
    from ocmm_core.documents import read_bytes, write_new
    from ocmm_core.export.certificate import (
        Expansion,
        artefact_text,
        quantities_read,
        read_dcc,
        trusted_signers,
    )
    from ocmm_core.seals import KeyFolder

    grows = (
        None
        if expansion is None or expansion_sigma is None
        else Expansion(expansion, expansion_sigma)
    )
    dcc = read_dcc(read_bytes(file), trusted_signers(KeyFolder()))
    text = artefact_text(dcc, kind, due, quantity=quantity, expansion=grows)
    state = write_new(out, text.encode("utf-8"))
    # The product's own reader must accept the file, or it is removed.
    try:
        _ = load_bar(out) if kind == "bar" else load_sphere(out)
    except Exception:
        HOST.remove_same(out, state.st_dev, state.st_ino)
        raise
    console = make_console(soft_wrap=True)
    console.print(f"{lead('Artefact  ')}{out}")
    console.show(dcc.signature.summary)
    read = quantities_read(dcc, kind, quantity=quantity)
    for one in dcc.quantities:
        is_read = any(one is other for other in read)
        sentence = (
            tr(f"Read: {one.name}, {one.value!r} {one.unit}.") if is_read
            else tr(f"Left out: {one.name}, {one.value!r} {one.unit}.")
        )  # fmt: skip
        console.print(sentence)


@certificate_app.command()
def trust(file: Path) -> None:
    """Trust the XML signatures of a calibration laboratory from now on."""
    from ocmm_core.export.certificate import trust_laboratory
    from ocmm_core.seals import KeyFolder

    found = trust_laboratory(file, KeyFolder().folder)
    make_console(soft_wrap=True).print(tr(f"Trusted: {found.subject.rfc4514_string()}"))
