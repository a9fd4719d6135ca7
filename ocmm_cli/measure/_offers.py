"""Output of ``ocmm plan``: features and tolerances of a model, and a planned rig."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from ocmm_cli.measure._pages import print_pages
from ocmm_cli.terminal import (
    heads,
    language,
    lead,
    make_console,
    print_grid,
    progress_line,
    tr,
    tr_word,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ocmm_cad.drawing import Account
    from ocmm_cad.step import FacesAccount, Offer, StepModel, StepRequest
    from ocmm_cli.terminal import PlainConsole
    from ocmm_core.tolerances.decisions import RequirementCount


@dataclass(frozen=True, slots=True)
class TargetOptions:
    """Ball, probe and cameras that the targets of a model are for, and the pose of the part."""

    ball: float | None
    probe: Path | None
    rig: Path | None
    up: str
    turn: float
    reach: bool
    sight: bool

    def request(self) -> StepRequest:
        from ocmm_cad.step import up_of, usual_request

        request = msgspec.structs.replace(
            usual_request(self.probe, self.rig, ball_mm=self.ball), up=up_of(self.up),
            turn_deg=self.turn,
        )  # fmt: skip
        if not self.reach:
            return msgspec.structs.replace(request, probe="", rig="")
        return request if self.sight else msgspec.structs.replace(request, rig="")


def print_offers(offers: Sequence[Offer], model: StepModel, console: PlainConsole) -> None:
    """Print a line for each surface of a model, with reasons against it."""
    from ocmm_cad.step import faces_account

    rows = []
    for offer in offers:
        faces = ",".join(map(str, offer.faces))
        count = str(len(offer.feature.targets) or "")
        rows.append((offer.feature.name, faces, f"{offer.size_mm:.3f}", count, offer.against))
    print_grid(console, heads("name", "faces", "size, mm", "targets", "against it"), rows)
    usual = [offer for offer in offers if not offer.against and offer.free_form is None]
    print_faces(faces_account(model, usual), console)
    if model.free_forms:
        console.print(free_form_words(model))
    if model.remark:
        console.show(model.remark, style="yellow")


def print_faces(account: FacesAccount, console: PlainConsole) -> None:
    """Print how many faces of a model became features, and why the others did not."""
    console.show(account.sentence())
    for why, count in account.left_out:
        console.print(f"{count:5}  {tr(why)}")
    if words := account.recognised_sentence():
        console.show(words)


def free_form_words(model: StepModel) -> str:
    """Return the number of free forms of a model, and the option that imports them."""
    count = len(model.free_forms)
    faces = tr("1 free-form face") if count == 1 else tr(f"{count:d} free-form faces")
    return tr(f"{faces} can be measured as profiles: give --profile with the width of the zone.")


def offers_json(offers: Sequence[Offer], model: StepModel) -> str:
    content = {
        "offers": [
            {
                "name": offer.feature.name,
                "shape": offer.kind,
                "faces": offer.faces,
                "size_mm": offer.size_mm,
                "side": offer.feature.side,
                "targets": len(offer.feature.targets),
                "against": offer.against,
            }
            for offer in offers
        ],
        "others": model.others,
        "not_measured": model.not_measured,
    }
    return msgspec.json.format(msgspec.json.encode(content), indent=2).decode()


def print_account(account: Account, console: PlainConsole) -> None:
    """Print the outcome of every item of a model, and counts by kind.

    Datum references and labels follow their item; both are counted, and separate in the JSON.
    """
    if not account.items:
        for remark in account.remarks:
            console.show(remark)
        return
    console.show("Tolerances of the model:")
    rows = []
    for item in account.by_itself():
        said = "; ".join(filter(None, (", ".join(item.became), tr(item.why), tr(item.remark))))
        rows.append((tr(item.status), item.name, item.kind, said))
    print_grid(console, ("", *heads("label", "says", "in the plan, or why not")), rows)
    for group, counts in account.counts().items():
        told = ", ".join(f"{count} {tr(word)}" for word, count in counts.items() if count)
        console.print(f"{tr(group)}: {sum(counts.values())} ({told})")
    for remark in account.remarks:
        console.show(remark)


def print_requirements(count: RequirementCount | None, console: PlainConsole) -> None:
    """Print the number of requirements of its sources a plan contains; nothing without a source."""
    if count is not None:
        console.show(count.sentence, style="" if count.is_whole else "bold yellow")


def account_json(account: Account, more: dict[str, Any]) -> str:
    """Return the account as JSON: counts by group, remarks and all items."""
    content = {
        **more,
        "complete": account.is_complete,
        "counts": account.counts(),
        "remarks": account.remarks,
        "items": account.items,
    }
    return msgspec.json.format(msgspec.json.encode(content), indent=2).decode()


def plan_rig(
    *, document: Path, out: Path, search: int, seed: int, rig: Path | None,
    calibrations: Path | None, pdf: bool, as_json: bool,
) -> None:  # fmt: skip
    """Predict U of a planned rig over its volume, and search better places of its cameras.

    Writes the prediction as JSON, a map from above as SVG, and with --pdf a sheet with places,
    angles, expected U, and what to buy. An example: resources/rig_plans/thesis.toml. With --rig,
    U of the rig as calibrated is predicted too, and compared with the plan.
    """
    from ocmm_cli.terminal import tip_map
    from ocmm_core.calibration.records import default_folder, open_calibration
    from ocmm_core.export import write_together
    from ocmm_core.measuring import map_range
    from ocmm_planner import (
        evaluate_plan,
        load_rig_plan,
        map_from_above,
        sheet_sentences,
        shopping_list,
    )

    plan = load_rig_plan(document)
    found = None if rig is None else open_calibration(rig, calibrations or default_folder()).rig
    with progress_line() as tell:
        sheet = evaluate_plan(
            plan, seed=seed, evaluations=search, calibrated=found,
            step=lambda share: tell(tr("Predicting the rig"), share),
        )  # fmt: skip
    content = msgspec.json.encode(sheet)
    written = [out / f"{document.stem}_rig{ending}" for ending in (".json", ".svg")]
    top = map_from_above(sheet)
    picture = tip_map(top, map_range([top]), f"{sheet.plan}, {sheet.probe}: U (k = 2)")
    write_together(dict(zip(written, (content, picture.encode("utf-8")), strict=True)))
    if pdf:
        written.append(written[0].with_suffix(".pdf"))
        print_pages(
            "ocmm_gui.reports._rig_sheet",
            [[str(written[0]), str(written[2]), "--language", language(os.environ)]],
            "rig_plan.pdf", "The sheet was not written", "The prediction is written as JSON.",
        )  # fmt: skip
    console = make_console()
    if as_json:
        console.out(content.decode(), highlight=False)
        return
    for sentence in sheet_sentences(sheet):
        console.show(sentence, highlight=True)
    rows = [
        (one.name, *(f"{value:.1f}" for value in (
            *one.centre, one.azimuth_deg, one.elevation_deg, one.roll_deg, one.focus)),
         f"{one.stop:g}")
        for one in sheet.cameras
    ]  # fmt: skip
    columns = heads("Camera", "X", "Y", "Z", "Azimuth °", "Elevation °", "Roll °", "Focus", "Stop")
    print_grid(console, columns, rows, tr_word("Places of the cameras"))
    for item in shopping_list(sheet):
        console.print(item)
    console.print(f"{lead('Written  ')}{', '.join(map(str, written))}")
