"""What other files bring into a plan: features of a table or a model, the frame of a document."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import Signal

from ocmm_core.alignment import Relocation, load_frame, relocation, saved_frame
from ocmm_core.inspection.plan import (
    Plan,
    add_feature,
    features_from_csv,
    with_alignment,
    with_model,
)
from ocmm_core.inspection.step import STEP_ENDINGS, STEP_SETUP, STEP_SIZE_MB, has_step, read_model
from ocmm_gui.kit import Worker, WorkLine, tr
from ocmm_gui.plan_editor._plan_items import ALIGNMENT, ItemKey

_FRAME = ".toml"
_LIMIT_MM = 0.1


@dataclass(frozen=True, slots=True)
class Imported:
    """The plan before and with what was imported, which item is new, and a sentence about it."""

    before: Plan
    plan: Plan
    chosen: ItemKey
    words: str


def with_file(
    plan: Plan,
    path: Path,
    *,
    relocate: bool,
    given_up: Callable[[], bool] = lambda: False,
    plan_file: Path | None = None,
) -> Imported:
    """Return the plan with what is in a file; a model takes up to a minute.

    Parameters
    ----------
    relocate
        A frame is to be found again at its control points, and not taken as it was saved.
    given_up
        Asked while a model is read.
    plan_file
        Where the plan is, with its model beside it; None where it was never saved, and no model is
        kept.

    Raises
    ------
    StorageError
        The model cannot be copied beside the plan.
    InputError
        The file cannot be used, or the plan could not be measured with it.
    """
    if path.suffix.lower() == _FRAME:
        return _with_frame(plan, path, relocate=relocate)
    left_out = 0
    if path.suffix.lower() in STEP_ENDINGS:
        model = read_model(path, given_up=given_up, with_part=plan_file is not None)
        found, left_out = model.features, sum(count for _, count in model.why_not())
    else:
        found = features_from_csv(path)
    more = plan
    for feature in found:
        more = add_feature(more, feature)
    if path.suffix.lower() in STEP_ENDINGS and plan_file is not None:
        more = with_model(more, plan_file, path, model.part)
    said = tr("%n features added from {name}.", "", len(found)).format(name=path.name)
    if left_out:
        said += " " + tr(
            "%n surfaces left out: fillets, text, narrow or free-form faces.", "", left_out
        )
    return Imported(plan, more, ItemKey("features", found[0].name), said)


def what_is_missing() -> str:
    """Return what has to be installed before a CAD model can be imported; empty for nothing."""
    if has_step():
        return ""
    return tr("CAD models (STEP) need an extra of some {size} MB: {command}").format(
        size=STEP_SIZE_MB, command=STEP_SETUP
    )


def _with_frame(plan: Plan, path: Path, *, relocate: bool) -> Imported:
    document = load_frame(path)
    before = plan.alignment
    limit = before.limit if isinstance(before, Relocation) else _LIMIT_MM
    rule = relocation(document, limit) if relocate else saved_frame(document)
    said = tr("The frame {name} is used as saved.")
    if relocate:
        said = tr("The frame {name} will be relocated at its control points.")
    return Imported(
        plan,
        with_alignment(plan, rule),
        ALIGNMENT,
        said.format(name=document.name),
    )


class Importing(WorkLine):
    """Reads a file beside the window and shows that it does; nothing while it does not."""

    imported = Signal(object)
    """Emits what was `Imported`."""
    failed = Signal(object)
    """Emits the exception: why nothing was."""

    def __init__(self) -> None:
        super().__init__(tr("Importing"))
        self._worker = Worker("ocmm-import", self)
        self._given_up = threading.Event()
        self._reads = False

    def read(
        self, plan: Plan, path: Path, *, relocate: bool, plan_file: Path | None = None
    ) -> None:
        """Begin with a file; what is read already is given up."""
        self._given_up.set()
        given_up = self._given_up = threading.Event()
        self._reads = True
        self.begin(tr("Importing {name}.").format(name=path.name), tr("F12 cancels."))
        self._worker.do(
            lambda: with_file(
                plan, path, relocate=relocate, given_up=given_up.is_set, plan_file=plan_file
            ),
            lambda found: self._done(given_up, found),
            lambda error: self._not_done(given_up, error),
        )

    def give_up(self) -> bool:
        """Read no more, and say whether something was being read."""
        reads, self._reads = self._reads, False
        self._given_up.set()
        self.end()
        return reads

    def close_work(self, limit_s: float) -> None:
        """Give up, and wait for the end of the thread; call it before the window goes."""
        self.give_up()
        self._worker.close(limit_s)

    def _done(self, given_up: threading.Event, found: Imported) -> None:
        if not given_up.is_set():
            self.give_up()
            self.imported.emit(found)

    def _not_done(self, given_up: threading.Event, error: Exception) -> None:
        if not given_up.is_set():
            self.give_up()
            self.failed.emit(error)
