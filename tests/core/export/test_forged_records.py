"""Signed records, registers, releases and settings: forgeries, honest files, files of 0.1."""

from __future__ import annotations

import hashlib
import shutil
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import pytest

from benchmarks.forged_records import Count, run
from ocmm_core.acceptance import ArtefactRegister, InterimHistory, finished_tests, load_artefact
from ocmm_core.documents import resource
from ocmm_core.errors import InputError, OcmmError, StorageError
from ocmm_core.export.audits import audit
from ocmm_core.inspection.plan import note_release, plan_release, release_in_job, release_plan
from ocmm_core.seals import KeyFolder, SealWord, memory_file, release_path
from ocmm_core.settings import Scope, SettingsFile, SettingsStore
from ocmm_core.storage import JobFile, JobHead, make_head
from tests.commands import Ocmm
from tests.host import amount
from tests.other_station import other_station

NOW = datetime(2026, 11, 28, 8, 0, tzinfo=UTC)
NOT_SIGNED = "Not signed: written before signatures, or the signature was removed."


@dataclass(frozen=True, slots=True)
class Site:
    """Files of all kinds after all forgeries were undone, and what became of these."""

    folder: Path
    count: Count

    @property
    def record(self) -> Path:
        (found,) = (self.folder / "tests" / "records").glob("*.json")
        return found


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Site:
    folder = tmp_path_factory.mktemp("site")
    return Site(folder, run(amount(440, 5_000), 1, folder, "EFFECTIVE-DIAMETER"))


def of_version_0_1(record: Path, folder: Path, **instrument: object) -> Path:
    """Return a copy as 0.1 wrote it: a bare hash. Forgers write the same."""
    content = msgspec.json.decode(record.read_bytes())["content"]
    content["instrument"] |= instrument
    raw = msgspec.json.encode(content, order="sorted")
    digest = hashlib.sha256(raw).hexdigest().encode()
    path = folder / record.name
    path.write_bytes(b'{"content":' + raw + b',"sha256":"' + digest + b'"}')
    return path


def test_no_forgery_passes_and_no_honest_file_is_accused(site: Site) -> None:
    # Every kind has its turn; which door passed a forgery is in the list.
    assert len(site.count.done) == 11
    assert site.count.passed == []
    assert site.count.accused == []


def test_a_test_edited_to_a_real_one_gets_no_certificate(
    site: Site, tmp_path: Path, ocmm_here: Ocmm
) -> None:
    forged = of_version_0_1(site.record, tmp_path, simulated=False, calibration_status="VALID")
    made = ocmm_here("certificate", "make", forged, "--no-pages", "--out", tmp_path / "out")
    assert made.returncode == 2
    assert NOT_SIGNED in made.stderr
    assert not (tmp_path / "out").exists()
    again = ocmm_here("acceptance", "recompute", forged)
    assert again.returncode == 2
    assert "matches the file" not in again.stdout
    assert "NOT SIGNED" in again.stdout


def test_a_record_of_0_1_opens_and_is_called_not_signed(site: Site, tmp_path: Path) -> None:
    (tmp_path / "records").mkdir()
    old = of_version_0_1(site.record, tmp_path / "records")
    (found,), unread = finished_tests(tmp_path)
    assert unread == ()
    assert found.states == ("SIMULATED", "NOT SIGNED")
    assert audit(old).faults == (NOT_SIGNED,)


def test_a_record_of_another_station_counts_once_its_key_is_trusted(
    site: Site, tmp_path: Path, ocmm_here: Ocmm
) -> None:
    arguments = ("certificate", "make", site.record, "--no-pages", "--out", tmp_path / "out")
    public = KeyFolder().station_key().public
    with other_station(tmp_path / "home"):
        refused = ocmm_here(*arguments)
        assert refused.returncode == 2
        assert "unknown station" in refused.stderr
        KeyFolder().trust(public, "Cell 1", "Ada", "compared", NOW)
        assert audit(site.record).signer.station == "Cell 1"
        assert ocmm_here(*arguments).returncode == 0
    (dcc,) = (tmp_path / "out").glob("*.dcc.xml")
    told = ocmm_here("certificate", "check", dcc)
    assert told.returncode == 1
    assert told.stdout.startswith("SIMULATED: ")


def test_entries_of_0_1_open_but_need_their_certificate_again(tmp_path: Path) -> None:
    entry = load_artefact(resource("artefacts", "acceptance_sphere.toml"))
    register = ArtefactRegister(tmp_path)
    register.add(msgspec.structs.replace(entry, id="old"), "Ada", NOW)
    line = msgspec.json.decode(register.path.read_bytes())
    del line["signature"]
    register.path.write_bytes(msgspec.json.encode(line) + b"\n")
    register = ArtefactRegister(tmp_path)
    assert register.faults() == {"old": NOT_SIGNED}
    with pytest.raises(InputError, match="Artefact 'old': Not signed") as caught:
        register.used("old")
    assert "--replace" in caught.value.remedy
    # A signed line after it vouches for its own entry only.
    register.add(msgspec.structs.replace(entry, id="new"), "Ada", NOW)
    assert list(ArtefactRegister(tmp_path).faults()) == ["old"]
    assert register.signer.word is SealWord.NOT_SIGNED
    register.add(msgspec.structs.replace(entry, id="old"), "Ada", NOW, replace=True)
    assert ArtefactRegister(tmp_path).faults() == {}
    assert ArtefactRegister(tmp_path).used("old").sizes == entry.sizes


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    path = tmp_path / "plan.toml"
    shutil.copy(resource("plans", "quick.toml"), path)
    return path


def edit_limit(plan: Path) -> None:
    text = plan.read_text("utf-8")
    assert "upper = " in text
    plan.write_text(text.replace("upper = ", "upper = 9", 1), "utf-8")


def test_an_edited_limit_voids_the_release(plan: Path, ocmm_here: Ocmm) -> None:
    assert "Plan release: not released." in ocmm_here("plan", "check", plan).stdout
    told = ocmm_here("plan", "release", plan, "--by", "Grace Hopper", "--reason", "rev. C")
    assert "released by Grace Hopper, " in told.stdout
    assert audit(plan).intact
    edit_limit(plan)
    assert "changed after the release by Grace Hopper" in ocmm_here("plan", "check", plan).stdout
    assert audit(plan).faults == ("The file was changed after its release.",)
    release_plan(plan, "Grace Hopper")
    assert plan_release(plan).released
    with other_station(plan.parent / "home"):
        assert not plan_release(plan).released
        assert "unknown key" in plan_release(plan).summary


@pytest.mark.parametrize("kept", [True, False], ids=["replaced", "removed before"])
def test_an_older_release_put_back_is_none(plan: Path, tmp_path: Path, *, kept: bool) -> None:
    release_plan(plan, "Grace Hopper", "rev. C")
    beside = release_path(plan)
    older = {path: path.read_bytes() for path in (plan, beside)}
    if not kept:
        # A forger who keeps the older release removes it before the later one is made.
        beside.unlink()
    edit_limit(plan)
    release_plan(plan, "Grace Hopper", "rev. D")
    # An honest move.
    moved = plan.parent.rename(tmp_path.with_name(f"{tmp_path.name} moved"))
    assert plan_release(moved / plan.name).summary.startswith("released by Grace Hopper")
    for path, content in older.items():
        (moved / path.name).write_bytes(content)
    put_back = moved / plan.name
    state = plan_release(put_back)
    assert not state.released
    assert "replaced by a later release" in state.summary
    assert audit(put_back).faults == ("A later release replaced this one.",)
    with JobFile.create(moved / "a.ocmm", made_head(put_back)) as job:
        note_release(job, state)
        assert release_in_job(job.head, job.events()) == state
    # The person who wants it back releases it again.
    release_plan(put_back, "Grace Hopper", "back to C")
    assert audit(put_back).intact


def made_head(plan: Path) -> JobHead:
    rig, probe = resource("rigs", "recommended.toml"), resource("probes", "standard.toml")
    return make_head(plan=plan, rig=rig, probe=probe, operator="me", part="P", serial="1")


def test_a_station_measures_released_plans_only_and_jobs_state_the_release(
    plan: Path, tmp_path: Path, ocmm_here: Ocmm, slow_rig: Path
) -> None:
    store = SettingsStore.of_this_user()
    store.change({"job.released_only": True}, Scope.USER)
    try:
        measure = ("measure", "--plan", plan, "--rig", slow_rig, "--out", tmp_path / "out")
        refused = ocmm_here(*measure)
        assert refused.returncode == 2
        assert (
            "the plan is not released, and this station measures released plans" in refused.stderr
        )
        release_plan(plan, "Grace Hopper")
        assert ocmm_here(*measure).returncode == 0
        edit_limit(plan)
        assert "NOT released: changed after" in ocmm_here(*measure).stderr
        # The demand outlives the document that states it.
        whole = store.user.path.read_bytes()
        for lost in (b"", b'schema = "ocmm.settings/1"\n'):
            store.user.path.unlink(missing_ok=True)
            if lost:
                store.user.path.write_bytes(lost)
            told = ocmm_here(*measure).stderr
            assert "NOT released: changed after" in told
            assert "edited outside this program" in told or "are missing" in told
        store.user.path.write_bytes(whole)
    finally:
        store.change({"job.released_only": False}, Scope.USER)
    free = ocmm_here("measure", "--plan", plan, "--rig", slow_rig, "--out", tmp_path / "free")
    assert free.returncode < 2
    (path,) = (tmp_path / "out").glob("*.ocmm")
    with JobFile.open(path) as job:
        found = release_in_job(job.head, job.events())
    assert found.released
    assert found.summary.startswith("released by Grace Hopper, ")
    report = ocmm_here("report", path, "--format", "json", "--out", tmp_path / "json")
    assert report.returncode == 0
    (json,) = (tmp_path / "json").glob("*_SIMULATED.json")
    assert msgspec.json.decode(json.read_bytes())["job"]["plan_release"] == found.summary
    seal = next(iter((tmp_path / "out").glob("*.seal.json")))
    assert f"{path.name} is as it was reported." in audit(seal).proofs
    with JobFile.open(path) as job:
        job.append_event("note", "later")
    assert f"{path.name} has changed since: 1 step came after the report." in audit(seal).proofs


def test_settings_edited_outside_need_a_name(tmp_path: Path, ocmm_here: Ocmm) -> None:
    store = SettingsStore.of_this_user()
    store.change({"temperature.sigma_k": 0.3}, Scope.USER)
    path = store.user.path
    try:
        assert audit(path).intact
        assert store.user.read().notes == ()
        path.write_text(path.read_text("utf-8").replace("0.3", "0.01"), "utf-8")
        assert not audit(path).intact
        (note,) = store.user.read().notes
        assert "edited outside this program" in note.what
        # A change by the program vouches for nothing that others edited.
        store.change({"temperature.valid_h": 4.0}, Scope.USER)
        assert not audit(path).intact
        assert ocmm_here("settings", "confirm", "--by", "Ada").returncode == 0
        assert audit(path).intact
        store.change({"window.zoom": 120}, Scope.USER)
        assert audit(path).intact
    finally:
        path.unlink()


def test_older_settings_put_back_need_a_name(tmp_path: Path) -> None:
    file = SettingsFile(tmp_path / "settings.toml")
    file.change({"temperature.sigma_k": 0.01})
    older = file.path.read_bytes()
    file.change({"temperature.sigma_k": 0.3})
    assert audit(file.path).intact
    file.path.write_bytes(older)
    (note,) = file.read().notes
    assert "older than the last ones that this station signed" in note.what
    with pytest.raises(InputError, match="older than the last ones"):
        audit(file.path)
    # A change vouches for nothing that was put back.
    file.change({"temperature.valid_h": 4.0})
    with pytest.raises(InputError, match="older than the last ones"):
        audit(file.path)
    file.confirm("Ada")
    assert audit(file.path).intact
    assert file.read().notes == ()


def test_older_settings_are_recognised_in_any_folder(tmp_path: Path) -> None:
    """Six places of an older version; the last one in a moved folder is accepted."""
    folder, kept = tmp_path / "settings", tmp_path / "kept"
    file = SettingsFile(folder / "settings.toml")
    file.change({"job.released_only": True, "temperature.sigma_k": 0.01})
    shutil.copytree(folder, kept)
    file.change({"temperature.sigma_k": 0.3})
    linked, far = tmp_path / "linked", tmp_path / "far" / "deep"
    linked.symlink_to(kept, target_is_directory=True)
    shutil.copytree(kept, far)
    (tmp_path / "hard").mkdir()
    (tmp_path / "hard" / "other.toml").hardlink_to(kept / "settings.toml")
    older = [
        kept / "settings.toml", linked / "settings.toml", far / "settings.toml",
        tmp_path / "hard" / "other.toml", linked / ".." / "kept" / "settings.toml",
    ]  # fmt: skip
    moved = folder.rename(tmp_path / "moved")
    shutil.copytree(kept, folder)
    older.append(file.path)
    for path in older:
        (note,) = SettingsFile(path).read().notes
        assert "older than the last ones that this station signed" in note.what
        with pytest.raises(InputError, match="older than the last ones"):
            audit(path)
    # Honest moves: renamed, linked, copied as a whole.
    again = tmp_path / "again"
    again.symlink_to(moved, target_is_directory=True)
    for there in (moved, again, Path(shutil.copytree(moved, tmp_path / "copied"))):
        now = SettingsFile(there / "settings.toml")
        assert now.read().notes == ()
        assert audit(now.path).intact
    now = SettingsFile(moved / "settings.toml")
    now.change({"temperature.sigma_k": 0.2})
    assert audit(now.path).intact
    with pytest.raises(InputError, match="older than the last ones"):
        audit(tmp_path / "copied" / "settings.toml")


def test_settings_started_again_are_later_versions_of_the_lost_ones(tmp_path: Path) -> None:
    file = SettingsFile(tmp_path / "settings.toml")
    file.change({"temperature.sigma_k": 0.01})
    lost = file.path.rename(tmp_path / "elsewhere.toml")
    file.change({"temperature.sigma_k": 0.3})
    file.confirm("Ada")
    assert audit(file.path).intact
    with pytest.raises(InputError, match="older than the last ones"):
        audit(lost)


def test_damaged_memory_of_settings_is_a_note(tmp_path: Path) -> None:
    file = SettingsFile(tmp_path / "settings.toml")
    file.change({"temperature.sigma_k": 0.01})
    memory_file(f"settings {file.path}").write_bytes(b"")
    (note,) = file.read().notes
    assert "the station's memory is damaged" in note.what
    assert file.read().values["temperature.sigma_k"] == 0.01
    with pytest.raises(StorageError, match="the station's memory is damaged"):
        audit(file.path)


def test_files_of_another_kind_or_version_are_not_called_changed(
    tmp_path: Path, ocmm_here: Ocmm
) -> None:
    entry = load_artefact(resource("artefacts", "acceptance_sphere.toml"))
    register = ArtefactRegister(tmp_path / "register")
    register.add(entry, "Ada", NOW)
    shutil.copy(register.path, tmp_path / "interim.chain")
    with pytest.raises(StorageError, match="line 1 is of another kind of file, or of a later"):
        InterimHistory(tmp_path)
    record = tmp_path / "records" / "later.json"
    record.parent.mkdir()
    content = msgspec.json.encode({"schema": "ocmm.acceptance/9", "added": 1}, order="sorted")
    digest = hashlib.sha256(content).hexdigest().encode()
    record.write_bytes(b'{"content":' + content + b',"sha256":"' + digest + b'"}')
    told = ocmm_here("acceptance", "status", "--folder", tmp_path).stdout
    assert "this record is of another kind, or of a later version" in " ".join(told.split())
    # Checks and registers of the same folder are no tests.
    assert ".chain" not in told
    assert "changed" not in told


def test_what_carries_no_signature_is_not_called_intact(tmp_path: Path) -> None:
    (tmp_path / "recording.ocr").write_bytes(b"x")
    found = audit(tmp_path / "recording.ocr")
    assert found.signer.word is SealWord.NOT_SIGNED
    assert not found.intact
    with pytest.raises(OcmmError, match="file not found"):
        audit(tmp_path / "nothing.pdf")
