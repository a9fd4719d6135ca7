"""``ocmm plan rig``: uncertainty and places of cameras before they are bought."""

from __future__ import annotations

import os
from pathlib import Path

import msgspec

from ocmm_cli.measure._pages import print_pages
from ocmm_cli.terminal import (
    heads,
    language,
    lead,
    make_console,
    print_grid,
    progress_line,
    say,
    say_word,
)


def plan_rig(
    *, document: Path, out: Path, search: int, seed: int, as_json: bool, pdf: bool
) -> None:
    """Predict U of a planned rig over its volume, and search better places of its cameras.

    Writes the prediction as JSON, a map from above as SVG, and with --pdf a sheet with places,
    angles, expected U, and what to buy. An example: resources/rig_plans/thesis.toml.
    """
    from ocmm_cli.terminal import tip_map
    from ocmm_core.documents import write_atomic
    from ocmm_core.measuring import map_range
    from ocmm_planner import (
        evaluate_plan,
        load_rig_plan,
        map_from_above,
        sheet_sentences,
        shopping_list,
    )

    plan = load_rig_plan(document)
    with progress_line() as tell:
        sheet = evaluate_plan(
            plan, seed=seed, evaluations=search,
            step=lambda share: tell(say("Predicting the rig"), share),
        )  # fmt: skip
    content = msgspec.json.encode(sheet)
    out.mkdir(parents=True, exist_ok=True)
    written = [out / f"{document.stem}_rig{ending}" for ending in (".json", ".svg")]
    write_atomic(written[0], content)
    top = map_from_above(sheet)
    picture = tip_map(top, map_range([top]), f"{sheet.plan}, {sheet.probe}: U (k = 2)")
    write_atomic(written[1], picture.encode("utf-8"))
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
        console.say(sentence, highlight=True)
    rows = [
        (one.name, *(f"{value:.1f}" for value in (
            *one.centre, one.azimuth_deg, one.elevation_deg, one.roll_deg, one.focus)),
         f"{one.stop:g}")
        for one in sheet.cameras
    ]  # fmt: skip
    columns = heads("Camera", "X", "Y", "Z", "Azimuth °", "Elevation °", "Roll °", "Focus", "Stop")
    print_grid(console, columns, rows, say_word("Places of the cameras"))
    for item in shopping_list(sheet):
        console.print(item)
    console.print(f"{lead('Written  ')}{', '.join(map(str, written))}")
