"""Settings: with any content of the documents the program starts, reports it, and loses nothing."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tomllib
from dataclasses import fields
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ocmm_core.documents import resource
from ocmm_core.errors import InputError, StorageError
from ocmm_core.export import FORMATS
from ocmm_core.export.template import load_paper, template_in_use, use_head
from ocmm_core.settings import (
    SECTIONS,
    SETTINGS,
    Kind,
    Note,
    Scope,
    SettingOrigin,
    Settings,
    SettingsFile,
    SettingsStore,
    spec_of,
    text_of,
    toml_text,
    value_of_text,
)
from tests.host import HANG_S


def _store(folder: Path) -> SettingsStore:
    return SettingsStore(
        SettingsFile(folder / "station" / "settings.toml"),
        SettingsFile(folder / "user" / "settings.toml"),
    )


def test_the_table_and_the_typed_settings_are_the_same() -> None:
    assert {spec.key.replace(".", "_") for spec in SETTINGS} == {f.name for f in fields(Settings)}
    assert {spec.section for spec in SETTINGS} == set(SECTIONS)
    for spec in SETTINGS:
        assert spec.label
        assert spec.tip
        assert (spec.kind is Kind.CHOICE) <= bool(spec.choices)
        assert (spec.kind in (Kind.NUMBER, Kind.WHOLE)) == bool(spec.number)
        if spec.kind is not Kind.KEYS:
            assert value_of_text(spec, text_of(spec.default)) == spec.default


def test_without_documents_all_is_as_shipped(tmp_path: Path) -> None:
    loaded = _store(tmp_path).load()
    assert loaded.settings.instrument_rig == resource("rigs", "recommended.toml")
    assert set(loaded.origins.values()) == {SettingOrigin.DEFAULT}
    assert not loaded.notes
    assert not any(loaded.differs(spec.key) for spec in SETTINGS)


def test_the_user_wins_over_the_station_and_the_command_line_over_both(tmp_path: Path) -> None:
    store = _store(tmp_path)
    store.change({"instrument.source": "ethercat:service", "window.theme": "light"})
    assert store.station.path.exists()
    assert tomllib.loads(store.user.path.read_text())["window"] == {"theme": "light"}
    loaded = store.load()
    assert loaded.origins["instrument.source"] is SettingOrigin.STATION
    assert loaded.origins["window.theme"] is SettingOrigin.USER
    assert loaded.differs("window.theme")
    store.change({"instrument.source": "ethercat:virtual"}, Scope.USER)
    assert store.load().settings.instrument_source == "ethercat:virtual"
    given = SettingsStore(store.station, store.user, {"instrument.source": "simulated"})
    assert given.load().origins["instrument.source"] is SettingOrigin.COMMAND_LINE
    assert given.load().settings.instrument_source == "simulated"
    # Set for everybody again, the user's own is taken out: else it would still win.
    store.change({"instrument.source": "ethercat:service"})
    assert store.load().settings.instrument_source == "ethercat:service"
    store.change({"instrument.source": None})
    assert store.load().origins["instrument.source"] is SettingOrigin.DEFAULT


@pytest.mark.parametrize(
    ("content", "state"),
    [
        (b"\xff\xfe\x00", "unusable"),
        (b"schema = ", "unusable"),
        (b'schema = "ocmm.plan/1"\n', "unusable"),
        (b"[window]\ntheme = 'light'\n", "unusable"),
        (b"a = " + b"[" * 5000, "unusable"),
        (b'schema = "ocmm.settings/2"\n[window]\ntheme = "light"\n', "future"),
    ],
)
def test_a_document_that_cannot_be_used_is_named_and_left(
    tmp_path: Path, content: bytes, state: str
) -> None:
    store = _store(tmp_path)
    store.user.path.parent.mkdir()
    store.user.path.write_bytes(content)
    assert store.user.read().state == state
    loaded = store.load()
    assert loaded.settings.window_theme == "dark"
    assert str(store.user.path) in loaded.notes[0].what
    assert store.user.path.read_bytes() == content
    if state == "future":
        with pytest.raises(StorageError, match="another version"):
            store.change({"window.theme": "light"})
        assert store.user.path.read_bytes() == content
        return
    (note,) = store.change({"window.theme": "light"})
    assert "settings-unusable-1.toml" in note.what
    assert (store.user.path.parent / "settings-unusable-1.toml").read_bytes() == content
    assert store.load().settings.window_theme == "light"


def test_a_folder_in_place_of_the_document_keeps_nobody_from_starting(tmp_path: Path) -> None:
    store = _store(tmp_path)
    store.user.path.mkdir(parents=True)
    assert str(store.user.path) in store.load().notes[0].what


def test_what_is_not_known_is_told_and_kept(tmp_path: Path) -> None:
    store = _store(tmp_path)
    store.user.path.parent.mkdir()
    store.user.path.write_text(
        'schema = "ocmm.settings/1"\nlater = 1\n'
        "[window]\nglow = { a = [1, 2.5], 'b c' = 2026-01-02T03:04:05Z }\ntheme = 'pink'\n"
        '[job]\noperator = "Anna"\n[moon]\nphase = "full"\n'
    )
    loaded = store.load()
    assert loaded.settings.job_operator == "Anna"
    assert loaded.settings.window_theme == "dark"
    told = " ".join(note.what for note in loaded.notes)
    for word in ("'later'", "'window.glow'", "'moon.phase'", "'pink'"):
        assert word in told
    before = tomllib.loads(store.user.path.read_text())
    store.change({"job.operator": 'O"Brien'})
    after = tomllib.loads(store.user.path.read_text())
    before["job"]["operator"] = 'O"Brien'
    assert after == before


def test_a_folder_without_rights_is_told_and_the_station_falls_back_to_the_user(
    tmp_path: Path,
) -> None:
    store = _store(tmp_path)
    # A file in place of the folder stops root as well.
    store.station.path.parent.write_text("")
    (note,) = store.change({"instrument.source": "ethercat:service"})
    assert "this user" in note.what
    assert store.load().origins["instrument.source"] is SettingOrigin.USER
    with pytest.raises(StorageError, match=r"settings\.toml"):
        store.change({"instrument.source": "ethercat:service"}, Scope.STATION)


def test_a_default_of_the_user_hides_a_station_that_cannot_be_written(tmp_path: Path) -> None:
    store = _store(tmp_path)
    store.change({"instrument.check_after_h": 2.0})
    held = store.station.path.read_bytes()
    locked = SettingsStore(SettingsFile(tmp_path / "file" / "settings.toml"), store.user)
    (tmp_path / "file").write_text("")
    locked.change({"instrument.check_after_h": 3.0})
    assert store.load().settings.instrument_check_after_h == 3.0
    assert store.station.path.read_bytes() == held


def test_a_default_of_the_user_wins_over_what_the_station_says(tmp_path: Path) -> None:
    store = _store(tmp_path)
    store.change({"window.theme": "light", "window.volume": 30}, Scope.STATION)
    assert store.load().settings.window_theme == "light"
    store.change({"window.theme": "dark"})
    loaded = store.load()
    assert loaded.settings.window_theme == "dark"
    assert loaded.origins["window.theme"] is SettingOrigin.USER
    assert not loaded.differs("window.theme")
    # Without a value of the station a default is in no document.
    store.change({"window.theme": None}, Scope.STATION)
    store.change({"window.theme": "dark", "window.volume": None})
    assert tomllib.loads(store.user.path.read_text()).get("window") is None
    assert store.load().settings.window_volume == 30


def test_what_cannot_be_taken_back_is_not_said_to_hold(tmp_path: Path) -> None:
    store = _store(tmp_path)
    store.change({"instrument.tip": "long"})
    text = store.station.path.read_text()
    # A folder without a lock: a file, because rights do not stop root from writing.
    locked = SettingsStore(_Unwritable(store.station.path), store.user)
    with pytest.raises(StorageError):
        locked.change({"instrument.tip": None})
    assert locked.load().settings.instrument_tip == "long"
    (note,) = locked.change({"instrument.tip": "short"})
    assert "this user" in note.what
    assert locked.load().settings.instrument_tip == "short"
    assert store.station.path.read_text() == text


class _Unwritable(SettingsFile):
    """A document that can be read but not written, even by root."""

    def change(self, *_: object, **__: object) -> tuple[Note, ...]:
        raise StorageError("settings.read_only", f"{self.path}: cannot be written.", "Ask.")


def test_temperatures_are_used_for_some_hours_only(tmp_path: Path) -> None:
    store = _store(tmp_path)
    store.change({"temperature.part_c": 23.5})
    now = datetime.now(UTC)
    assert store.load(now).settings.temperature_part_c == 23.5
    # Another temperature that is typed later does not make this one younger.
    text = store.station.path.read_text()
    old = (now - timedelta(hours=7)).isoformat(timespec="seconds")
    stamp = tomllib.loads(text)["temperature"]["part_c_utc"]
    store.station.path.write_text(text.replace(stamp, old))
    store.change({"temperature.probe_c": 22.0})
    loaded = store.load(now + timedelta(hours=2))
    assert loaded.settings.temperature_part_c is None
    assert loaded.settings.temperature_probe_c == 22.0
    assert loaded.too_old == ("temperature.part_c",)
    # The time was edited by hand, so the first note is about the signature.
    assert "Part temperature" in loaded.notes[-1].what
    # A clock that was set back: the age is undetermined.
    assert store.load(now - timedelta(days=1)).settings.temperature_probe_c is None
    # Typed into the file by hand, without a time.
    store.station.path.write_text(
        'schema = "ocmm.settings/1"\n[temperature]\npart_c = 21.0\nprobe_c = 21.0\n'
        'probe_c_utc = "yesterday"\n'
    )
    loaded = store.load(now)
    assert loaded.settings.temperature_part_c is None
    assert loaded.settings.temperature_probe_c is None
    # The signature is gone, which is the first note.
    assert len(loaded.notes) == 3


_BAD: dict[str, list[object]] = {
    "instrument.source": ["webcam", "ethercat:", "replay:"],
    "instrument.rig": [resource("probes", "standard.toml"), "/no/such/rig.toml", resource()],
    "instrument.check_after_h": ["0", "1000", "nan", "inf", "eight"],
    "instrument.bus_processor": ["-1", "2000", "1.5", "last"],
    "temperature.part_c": ["200", "-300", "warm"],
    "stream.port": ["0", "70000", "7788.5"],
    "window.theme": ["pink"],
    "window.sounds": ["maybe"],
    "report.logo": [resource("rigs", "recommended.toml")],
    "job.folder": [resource("rigs", "recommended.toml")],
    "window.keys": ["take: X"],
    "job.operator": ["a\x07b", "x" * 1001],
}


@pytest.mark.parametrize("key", _BAD)
def test_what_is_typed_is_checked(key: str) -> None:
    for text in _BAD[key]:
        with pytest.raises(InputError) as caught:
            value_of_text(spec_of(key), str(text))
        assert spec_of(key).label in caught.value.what


def test_cameras_and_trackers_of_others_can_be_chosen() -> None:
    source, rig = spec_of("instrument.source"), spec_of("instrument.rig")
    for text in ("genicam:40012345,40012346", "genicam:untimed,1,2", "igtl:192.168.1.7:18944",
                 "ndi:virtual", "replay:/data/raw file.ocmmrec"):  # fmt: skip
        assert value_of_text(source, text) == text
    for name in ("recommended", "tracker", "tracker_ndi"):
        path = resource("rigs", f"{name}.toml")
        assert value_of_text(rig, str(path)) == path


def test_what_is_typed_is_read_as_people_write_it(tmp_path: Path) -> None:
    assert value_of_text(spec_of("temperature.part_c"), " 21,5 ") == 21.5
    assert value_of_text(spec_of("window.sounds"), "No") is False
    assert value_of_text(spec_of("job.operators"), "Anna; Ben;") == ("Anna", "Ben")
    assert value_of_text(spec_of("stream.port"), "7788") == 7788
    assert value_of_text(spec_of("instrument.tip"), "") is None
    assert value_of_text(spec_of("job.folder"), str(tmp_path / "new")) == tmp_path / "new"


@given(
    st.dictionaries(
        st.text(min_size=1, max_size=8),
        st.dictionaries(
            st.text(min_size=1, max_size=8),
            st.recursive(
                st.booleans()
                | st.integers(-(2**62), 2**62)
                | st.floats(allow_nan=False)
                | st.text(st.characters(exclude_categories=["Cs"]), max_size=8),
                lambda item: (
                    st.lists(item, max_size=3)
                    | st.dictionaries(st.text(min_size=1, max_size=4), item, max_size=3)
                ),
                max_leaves=6,
            ),
            max_size=3,
        ),
        max_size=3,
    )
)
def test_what_is_written_is_read_back_the_same(data: dict[str, object]) -> None:
    assert tomllib.loads(toml_text(data)) == data


_WRITER = """
import sys
from pathlib import Path
from ocmm_core.settings import SettingsFile
file = SettingsFile(Path(sys.argv[1]))
for number in range(20):
    names = file.read().values.get("job.operators", ())
    file.change({sys.argv[2]: float(number + 1)})
"""


def test_two_programs_at_once_lose_nothing(tmp_path: Path) -> None:
    path = tmp_path / "settings.toml"
    keys = ("instrument.check_after_h", "temperature.sigma_k", "temperature.part_c")
    # 20 is beyond the limit of the second: it stops at its last good one.
    writers = [
        subprocess.Popen([sys.executable, "-c", _WRITER, str(path), key], stderr=subprocess.PIPE)
        for key in keys
    ]
    for writer in writers:
        writer.communicate(timeout=HANG_S)
    values = SettingsFile(path).read().values
    assert values == {
        "instrument.check_after_h": 20.0,
        "temperature.sigma_k": 10.0,
        "temperature.part_c": 20.0,
    }
    assert [found.name for found in tmp_path.iterdir()] == ["settings.toml"]


def test_the_settings_load_no_numerical_library() -> None:
    code = (
        "import sys; from ocmm_core.settings import SettingsStore; "
        "SettingsStore.of_this_user().load(); "
        "print([m for m in ('numpy', 'scipy', 'numba', 'PySide6') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=HANG_S, check=True
    )
    assert done.stdout.strip() == "[]"


def test_the_formats_of_the_key_are_those_that_there_are() -> None:
    spec = spec_of("report.formats")
    assert spec.choices == tuple(FORMATS)
    assert value_of_text(spec, "pdf; qif; pdf") == ("pdf", "qif")
    assert value_of_text(spec, "") == ("polyworks",)
    for wrong in ("pdf; word", ";"):
        with pytest.raises(InputError, match="must be some of polyworks"):
            value_of_text(spec, wrong)


def test_the_head_of_the_settings_is_the_template_of_every_report(tmp_path: Path) -> None:
    store = _store(tmp_path)
    store.change(
        {
            "report.laboratory": "Lab", "report.machine": "OCMM 1", "report.machine_serial": "7",
            "report.place": "Room 2", "report.signatures": ("Inspector, date",),
            "report.country": "DE", "report.accreditation": "D-K-1", "report.contact": "mail",
        }
    )  # fmt: skip
    use_head(store.load().settings, tmp_path / "heads")
    made = load_paper(template_in_use()).template
    assert (made.laboratory.name, made.laboratory.country) == ("Lab", "DE")
    assert (made.laboratory.accreditation, made.laboratory.contact) == ("D-K-1", "mail")
    assert (made.machine.name, made.machine.serial, made.place) == ("OCMM 1", "7", "Room 2")
    assert made.signatures == ["Inspector, date"]
    # What no report can take is refused, and the head before stays.
    store.change({"report.country": "Germany"})
    with pytest.raises(InputError, match="two capital letters"):
        use_head(store.load().settings, tmp_path / "heads")
    assert load_paper(template_in_use()).template.laboratory.country == "DE"
    shutil.rmtree(template_in_use().parent)
