"""Import into a plan: features of a table or a model, the frame of a document."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import msgspec
from PySide6.QtCore import Qt, Signal

from ocmm_cad import profiles, step
from ocmm_cad.drawing import NOT_IMPORTED, Account, plan_with_tolerances, with_account
from ocmm_core.alignment import Relocation, load_frame, relocation, saved_frame
from ocmm_core.camera import Rig
from ocmm_core.features.shapes import NominalFeature
from ocmm_core.inspection import plan as plans
from ocmm_core.part_model import STEP_ENDINGS
from ocmm_core.plugins import install_line
from ocmm_core.tables import TableOptions, TablePreview, preview_table
from ocmm_core.tracking import ProbeBody
from ocmm_gui.kit import said, tr
from ocmm_gui.plan_editor._plan_items import ALIGNMENT, HEAD, ItemKey
from ocmm_gui.work import Worker, WorkLine

InUse: TypeAlias = tuple[Rig, ProbeBody]
"""Cameras and probe of the station."""
_FRAME = ".toml"
_UP = "+z"
_LIMIT_MM = 0.1


@dataclass(frozen=True, slots=True)
class ImportResult:
    """The plan before and after an import, the new item, and a message.

    With an account, the plan has the imported tolerances of a model, and ``bare`` is the plan
    without them. It is doubtful if selected items were left out or not checked.
    """

    before: plans.Plan
    plan: plans.Plan
    chosen: ItemKey
    words: str
    account: Account | None = None
    bare: plans.Plan | None = None
    is_doubtful: bool = False

    def without_tolerances(self) -> ImportResult:
        return replace(self, plan=self.bare or self.plan, account=None, bare=None)


@dataclass(frozen=True, slots=True)
class LoadedModel:
    """A model that was read, for the selection."""

    path: Path
    model: step.StepModel
    offers: tuple[step.Offer, ...]
    """All surfaces that can become features."""
    up: str
    """Axis of the model that points up."""

    def account(
        self, taken: Sequence[step.Offer], refused: Sequence[step.LeftOut] = ()
    ) -> step.FacesAccount:
        """Return the result of each face of the file, see `faces_account`."""
        return step.faces_account(self.model, taken, refused)


def with_table(plan: plans.Plan, table: plans.FeatureTable) -> ImportResult:
    """Return the plan with the features of a table; InputError if it became unmeasurable."""
    found = _with_features(plan, table.account.path, table.features)
    return replace(found, plan=table.added_to(plan))


def model_of(
    path: Path,
    up: str,
    in_use: InUse | None,
    given_up: Callable[[], bool],
    progress: Callable[[str], None],
) -> LoadedModel:
    """Return the offers of a model, for the probe and cameras in use; InputError if unusable.

    `up`: axis of the model that points up. `in_use`: None for the standard probe and the
    recommended rig. `given_up`, `progress`: as of `read_model`; it takes up to a minute.
    """
    request = msgspec.structs.replace(step.usual_request(), up=step.up_of(up))
    setting = None
    if in_use is not None:
        rig, body = in_use
        setting = step.setting_for(body, rig, step.up_of(up))
    model = step.read_model(
        path, given_up=given_up, progress=progress, with_part=True, request=request,
        setting=setting,
    )  # fmt: skip
    return LoadedModel(path, model, step.offers_of(model), up)


def with_offers(
    plan: plans.Plan,
    read: LoadedModel,
    taken: Sequence[step.Offer],
    plan_file: Path | None,
    zone_mm: float | None = None,
    given_up: Callable[[], bool] = lambda: False,
    progress: Callable[[str], None] = lambda _: None,
) -> ImportResult:
    """Return the plan with the selection from a model, and with its tolerances.

    Checks omitted for a large model are made now, see `ask_for_chosen`.

    `plan_file`: Path of the plan, with its model next to it; None if never saved: no model is kept.
    `zone_mm`: Width of the zone of the profile of free forms; None without any.

    StorageError if the model cannot be copied, InputError if the plan became unmeasurable.
    """
    reach = step.ask_for_chosen(read.model, taken, given_up, progress)
    taken = reach.taken
    surfaces = [offer.feature for offer in taken if offer.free_form is None]
    free_forms = [offer.free_form for offer in taken if offer.free_form is not None]

    def more_of(plan: plans.Plan) -> plans.Plan:
        return plan if zone_mm is None else profiles.with_profiles(plan, free_forms, zone_mm)

    found = _with_features(plan, read.path, surfaces)
    faces = read.account(taken, reach.refused)
    counted = (faces.sentence(), faces.recognised_sentence())
    found = replace(found, words=" ".join((found.words, *(said(one) for one in counted if one))))
    if free_forms and zone_mm is not None:
        added = tr("%n free-form faces added.", "1 free-form face added.", len(free_forms))
        words = f"{found.words} {added}" if surfaces else added
        key = ItemKey("characteristics", free_forms[0].name)
        found = replace(found, words=words, chosen=found.chosen if surfaces else key)
    if said_of_reach := [said(one) for one in reach.sentences()]:
        words = " ".join((found.words, *said_of_reach))
        found = replace(found, words=words, is_doubtful=True)
    if plan_file is not None:
        more = plans.with_model(found.plan, plan_file, read.path, read.model.part)
        found = replace(found, plan=more)
    toleranced, account = plan_with_tolerances(found.plan, read.model)
    bare = more_of(found.plan)
    if not account.items:
        return replace(found, plan=bare)
    bare = with_account(bare, read.model, account, read.path, NOT_IMPORTED)
    # In the datum system of the tolerances, if they have one.
    toleranced = with_account(more_of(toleranced), read.model, account, read.path)
    return replace(found, plan=toleranced, account=account, bare=bare)


def _with_features(plan: plans.Plan, path: Path, found: Sequence[NominalFeature]) -> ImportResult:
    more = plan
    for feature in found:
        more = plans.add_feature(more, feature)
    added = tr("%n features added from {name}.", "1 feature added from {name}.", len(found)).format(
        name=path.name
    )
    return ImportResult(plan, more, ItemKey("features", found[0].name) if found else HEAD, added)


def what_is_missing() -> str:
    """Return the requirement for importing a CAD model; empty if met."""
    if step.has_step():
        return ""
    return tr("CAD models (STEP) need an extra of some {size} MB: {command}.").format(
        size=step.STEP_SIZE_MB, command=install_line("step")
    )


def _with_frame(plan: plans.Plan, path: Path, *, relocate: bool) -> ImportResult:
    document = load_frame(path)
    before = plan.alignment
    limit = before.limit if isinstance(before, Relocation) else _LIMIT_MM
    rule = relocation(document, limit) if relocate else saved_frame(document)
    words = tr("The frame {name} is used as saved.")
    if relocate:
        words = tr("The frame {name} will be relocated at its control points.")
    return ImportResult(
        plan, plans.with_alignment(plan, rule), ALIGNMENT, words.format(name=document.name)
    )


class ImportLine(WorkLine):
    """Read a file in the background, showing progress; ``in_use``: the station's equipment."""

    imported = Signal(object)
    offered = Signal(object)
    """Emits a `LoadedModel`: its features are to be selected."""
    previewed = Signal(object)
    """Emits the `TablePreview` of a table: it is to be confirmed."""
    part_read = Signal(object)
    """Emits the `PartOfPlan` of a plan's model."""
    failed = Signal(object)
    _reading = Signal(str)

    def __init__(self, in_use: Callable[[], InUse] | None = None) -> None:
        super().__init__(tr("Importing"))
        self._in_use = in_use
        self._worker = Worker("ocmm-import", self)
        self._given_up = threading.Event()
        self._reads = False
        # Emitted by the reading thread, shown by the window.
        self._reading.connect(self._show_progress, Qt.ConnectionType.QueuedConnection)

    def read(
        self,
        plan: plans.Plan,
        path: Path,
        *,
        relocate: bool,
        up: str = _UP,
        options: TableOptions | None = None,
    ) -> None:
        """Start to read a file, cancelling an earlier one.

        `relocate`: relocate a frame at its control points instead of using it as saved. `up`: axis
        of a model that points up. `options`: user's statements about a table.
        """
        is_model = path.suffix.lower() in STEP_ENDINGS
        in_use = None if self._in_use is None else self._in_use()

        def work(given_up: threading.Event) -> object:
            if is_model:
                return model_of(path, up, in_use, given_up.is_set, self._reading.emit)
            if path.suffix.lower() == _FRAME:
                return _with_frame(plan, path, relocate=relocate)
            return preview_table(path, options or TableOptions(), plans.feature_table)

        self._start(tr("Importing {name}.").format(name=path.name), work)

    def read_part(self, plan: plans.Plan, folder: Path | None) -> None:
        """Start to load the part of a plan, cached or read from its model."""
        self._start(
            tr("Reading the model of the plan."),
            lambda given_up: plans.part_of_plan(plan, folder, given_up.is_set, self._reading.emit),
        )

    def import_selection(
        self,
        plan: plans.Plan,
        model: LoadedModel,
        taken: Sequence[step.Offer],
        plan_file: Path | None,
        zone_mm: float | None = None,
    ) -> None:
        """Add the selection from a model to a plan; see `with_offers`."""
        self._start(
            tr("Importing {name}.").format(name=model.path.name),
            lambda given_up: with_offers(
                plan, model, taken, plan_file, zone_mm, given_up.is_set, self._reading.emit
            ),
        )

    def _start(self, words: str, work: Callable[[threading.Event], object]) -> None:
        """Start work, which the event cancels, and cancel earlier work."""
        self._given_up.set()
        given_up = self._given_up = threading.Event()
        self._reads = True
        self.start(words, tr("Shift+F9 cancels."))
        self._worker.do(
            lambda: work(given_up),
            lambda found: self._done(given_up, found),
            lambda error: self._not_done(given_up, error),
        )

    def give_up(self) -> bool:
        """Cancel reading; return whether a file was being read."""
        reads, self._reads = self._reads, False
        self._given_up.set()
        self.end()
        return reads

    def close_work(self, limit_s: float) -> None:
        """Cancel, and wait for the end of the thread; call it before the window closes."""
        self.give_up()
        self._worker.close(limit_s)

    def _done(self, given_up: threading.Event, found: object) -> None:
        if not given_up.is_set():
            self.give_up()
            if isinstance(found, plans.PartOfPlan):
                self.part_read.emit(found)
            elif isinstance(found, TablePreview):
                self.previewed.emit(found)
            else:
                (self.offered if isinstance(found, LoadedModel) else self.imported).emit(found)

    def _show_progress(self, what: str) -> None:
        if self._reads:
            self.start(tr("Importing: {what}.").format(what=said(what)), tr("Shift+F9 cancels."))

    def _not_done(self, given_up: threading.Event, error: Exception) -> None:
        if not given_up.is_set():
            self.give_up()
            self.failed.emit(error)
