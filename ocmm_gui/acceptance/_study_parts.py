"""Parts of the gauge study sheet: keys, fields, columns, and typed numbers."""

from __future__ import annotations

from PySide6.QtWidgets import QGridLayout

from ocmm_core.studies import CharacteristicStudy
from ocmm_gui.kit import ActionInfo, FormField, Mark, caption, form_field, later, localised, tr

KEYS = (
    ActionInfo("draw", later("Draw plan"), later("Draw the order and blind codes, and store them"),
               ("F6",)),
    ActionInfo("plan", later("Open plan"), later("Open the plan of a study"), ("F7",)),
    ActionInfo("jobs", later("Jobs"), later("Choose the folder of the jobs"), ("Shift+F7",)),
    ActionInfo("look", later("Progress"), later("Which measurement comes next"), ("Shift+F6",)),
    ActionInfo("analyse", later("Analyse"), later("Gauge R&R of every characteristic"), ("F8",)),
    ActionInfo("type1", later("Type 1"), later("Cg and Cgk of the selected characteristic"),
               ("F10",)),
    ActionInfo("stop", later("Stop"), later("Stop the analysis"), ("F9",)),
)  # fmt: skip
FIELDS = (
    ("name", later("Study"), later("Name; also the batch of its jobs"), later("STUDY-1")),
    ("parts", later("Parts"), later("How many"), "10"),
    ("operators", later("Operators"), later("Names, parted by commas"), "A,B,C"),
    ("trials", later("Trials"), later("Of each operator on each part"), "3"),
    ("seed", later("Seed"), later("The order is drawn from it"), "1"),
    ("reference", later("Reference, mm"), later("Certified value, for type 1"), ""),
)
COLUMNS = (
    (later("Characteristic"), later("As in the inspection plan")),
    (later("GRR, µm"), later("Standard deviation, with its 90 % interval")),
    (later("% study"), later("GRR of the whole variation")),
    (later("% tol."), later("6 GRR of the tolerance")),
    (later("ndc"), later("Distinct categories")),
    (later("Own U"), later("Scatter found over the uncertainty that is stated")),
    (later("Verdict"), later("AIAG: 10 and 30 %, ndc 5")),
)
MARKS = {"good": Mark.GOOD, "conditional": Mark.DOUBT, "not acceptable": Mark.BAD}


def row_words(one: CharacteristicStudy) -> tuple[str, ...]:
    """Return the row of a characteristic, in the order of `COLUMNS`."""
    study = one.study
    if study is None:
        return (one.name, "–", "–", "–", "–", "–", tr("none"))
    tolerance = study.tolerance_percent
    return (
        one.name,
        localised(f"{1e3 * study.grr:.2f} ({1e3 * study.grr_low:.2f}–{1e3 * study.grr_high:.2f})"),
        localised(f"{study.study_percent:.1f}"),
        "–" if tolerance is None else localised(f"{tolerance:.1f}"),
        str(study.ndc),
        "–" if one.stated is None else localised(f"{one.stated.pooled:.2f}"),
        study.word,
    )


def fields_of_study(fields: dict[str, FormField]) -> QGridLayout:
    """Return the form of a new study, and add its fields to ``fields`` by key."""
    form = QGridLayout()
    form.setHorizontalSpacing(10)
    for index, (key, label, tip, proposal) in enumerate(FIELDS):
        field = form_field(tr(label), tr(tip), proposal)
        field.setObjectName(key)
        field.setAccessibleDescription(tr(tip))
        fields[key] = field
        row, column = divmod(index, 3)
        form.addWidget(caption(tr(label), field), row, 2 * column)
        form.addWidget(field, row, 2 * column + 1)
    return form
