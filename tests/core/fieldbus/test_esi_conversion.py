"""Device descriptions from ESI files: conversion, questions, and hostile files."""

from __future__ import annotations

from pathlib import Path

import pytest

from ocmm_core.documents import resource
from ocmm_core.errors import InputError
from ocmm_core.fieldbus.described import (
    Clock,
    EsiStatements,
    ProcessImage,
    Role,
    Sends,
    choose_device,
    describe_esi,
    load_device,
    missing_statements,
)
from ocmm_sim.slave import esi_document

HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<EtherCATInfo Version="1.6"><Vendor><Id>4919</Id></Vendor><Descriptions><Devices>"""
TAIL = """</Devices></Descriptions></EtherCATInfo>"""
DEVICE = """
<Device Physics="YY">
 <Type ProductCode="#x00001234" RevisionNo="#x2">Spot "finder"</Type>
 <Sm DefaultSize="128" StartAddress="#x1000" ControlByte="#x26" Enable="1">MBoxOut</Sm>
 <Sm DefaultSize="128" StartAddress="#x1080" ControlByte="#x22" Enable="1">MBoxIn</Sm>
 <Sm StartAddress="#x1100" ControlByte="#x24" Enable="1">Outputs</Sm>
 <Sm StartAddress="#x1400" ControlByte="#x20" Enable="1">Inputs</Sm>
 <RxPdo Sm="2"><Index>#x1600</Index><Name>Out</Name>
  <Entry><Index>#x7000</Index><SubIndex>1</SubIndex><BitLen>1</BitLen><DataType>BOOL</DataType></Entry>
  <Entry><Index>#x0</Index><BitLen>15</BitLen></Entry>
 </RxPdo>
 <TxPdo Sm="3"><Index>#x1A00</Index><Name>In</Name>
  <Entry><Index>#x6000</Index><SubIndex>1</SubIndex><BitLen>1</BitLen><Name>ok 1</Name><DataType>BOOL</DataType></Entry>
  <Entry><Index>#x6000</Index><SubIndex>2</SubIndex><BitLen>1</BitLen><Name>ok 2</Name><DataType>BOOL</DataType></Entry>
  <Entry><Index>0</Index><SubIndex>0</SubIndex><BitLen>6</BitLen></Entry>
  <Entry><Index>#x6000</Index><SubIndex>3</SubIndex><BitLen>12</BitLen><Name>count</Name><DataType>BITARR12</DataType></Entry>
  <Entry><Index>#x6010</Index><SubIndex>1</SubIndex><BitLen>24</BitLen><Name>x1</Name><DataType>INT24</DataType></Entry>
  <Entry><Index>#x6010</Index><SubIndex>2</SubIndex><BitLen>24</BitLen><Name>y1</Name><DataType>INT24</DataType></Entry>
  <Entry><Index>#x6020</Index><SubIndex>1</SubIndex><BitLen>24</BitLen><Name>x2</Name><DataType>INT24</DataType></Entry>
  <Entry><Index>#x6020</Index><SubIndex>2</SubIndex><BitLen>24</BitLen><Name>y2</Name><DataType>INT24</DataType></Entry>
  <Entry><Index>#x6030</Index><SubIndex>1</SubIndex><BitLen>120</BitLen><Name>text</Name><DataType>STRING(15)</DataType></Entry>
 </TxPdo>
 <TxPdo><Index>#x1A01</Index><Name>Extra</Name></TxPdo>
 <Dc><OpMode><Name>DC</Name><AssignActivate>#x0300</AssignActivate></OpMode></Dc>
 <Eeprom><ByteSize>2048</ByteSize></Eeprom>
</Device>"""  # noqa: E501 - lines as in such files
ROLES = {
    Role.X: ("0x6010:01", "0x6020:01"), Role.Y: ("0x6010:02", "0x6020:02"),
    Role.VALID: ("0x6000:01", "0x6000:02"), Role.COUNTER: ("0x6000:03",),
}  # fmt: skip
STATED = EsiStatements(
    ROLES, {"0x7000:01": 1}, Sends.PIXELS, 0.001, Clock.DISTRIBUTED, 100, latency_ns=7
)


def esi(folder: Path, text: str, encoding: str = "utf-8") -> Path:
    path = folder / "device.xml"
    path.write_bytes(text.encode(encoding))
    return path


def test_converts_bits_gaps_and_odd_integers(tmp_path: Path) -> None:
    found = choose_device(esi(tmp_path, HEAD + DEVICE + TAIL))
    assert "1 x Eeprom" in found.left_out
    assert any("0x1a01 'Extra'" in part for part in found.left_out)
    assert not missing_statements(found, STATED)
    path = tmp_path / "spots.toml"
    path.write_text(describe_esi(found, STATED), encoding="utf-8")
    device = load_device(str(path))
    assert (device.vendor, device.product, device.revisions) == (4919, 0x1234, (2, 2))
    assert device.name == 'Spot "finder"'
    assert device.mailbox == (0x1000, 128, 0x1080, 128)
    assert device.memory == (0x1100, 0x1400)
    assert (device.slots, device.clock, device.latency_ns) == (2, Clock.DISTRIBUTED, 7)
    image = ProcessImage(device)
    assert (image.input_bytes, image.output_bytes) == ((8 + 12 + 96 + 120 + 7) // 8, 2)
    values: dict[tuple[Role, int, int], float] = {
        (Role.X, 0, 0): -5.0, (Role.Y, 0, 1): 8388607.0, (Role.VALID, 0, 1): 1.0,
        (Role.COUNTER, -1, -1): 4095.0,
    }  # fmt: skip
    content = image.pack_inputs(values)
    assert int.from_bytes(content, "little") == (
        0b10 | 4095 << 8 | (2**24 - 5) << 20 | 8388607 << (20 + 72)
    )
    assert image.numbers(content, Role.X).tolist() == [[-5.0, 0.0]]


def test_reads_unnamed_sync_managers_by_their_control_byte(tmp_path: Path) -> None:
    unnamed = DEVICE
    for kind in ("MBoxOut", "MBoxIn", "Outputs", "Inputs"):
        unnamed = unnamed.replace(f">{kind}</Sm>", "/>")
    found = choose_device(esi(tmp_path, HEAD + unnamed + TAIL))
    assert not missing_statements(found, STATED)
    # UINT32 of such files states the size, not the sign.
    sizes = unnamed.replace(">INT24<", ">UINT24X<")
    with pytest.raises(InputError, match="not a number that is known"):
        describe_esi(choose_device(esi(tmp_path, HEAD + sizes + TAIL)), STATED)


def test_asks_for_everything_that_the_file_does_not_state(tmp_path: Path) -> None:
    found = choose_device(esi(tmp_path, HEAD + DEVICE + TAIL))
    asked = " ".join(missing_statements(found, EsiStatements()))
    for words in ("'x' of the spots", "'y' of", "0x7000:01", "which unit", "one step", "clock"):
        assert words in asked
    with pytest.raises(InputError, match="Which entries"):
        describe_esi(found, EsiStatements())
    for roles, words in (
        ({Role.X: ("0x6010:09",)}, "no mapped entry 0x6010:09"),
        ({Role.X: ("0x6010:01",), Role.Y: ("0x6010:01",)}, "has two roles"),
        ({Role.X: ("0x6010:01", "0x6020:01"), Role.Y: ("0x6010:02",)}, "not as many"),
        ({Role.COUNTER: ("0x6000:01", "0x6000:03")}, "'counter' cannot be stated for 2"),
        ({Role.CONSTANT: ("0x6000:01",)}, "'constant' cannot be stated"),
    ):
        assert words in " ".join(missing_statements(found, EsiStatements(roles)))


def test_reads_its_own_esi_file(tmp_path: Path) -> None:
    path = tmp_path / "own.xml"
    path.write_bytes(esi_document())
    found = choose_device(path)
    assert found.has_clock
    assert sum(entry.bits for pdo in found.inputs for entry in pdo.entries) > 1000


def test_chooses_among_devices_by_code_and_revision(tmp_path: Path) -> None:
    newer = DEVICE.replace('#x2"', '#x3"').replace("#x1400", "#x1500")
    path = esi(tmp_path, HEAD + DEVICE + newer + TAIL)
    with pytest.raises(InputError, match="2 of 2 devices match: 0x00001234 revision 0x00000002"):
        choose_device(path, product=0x1234)
    assert choose_device(path, revision=3).revision == 3
    with pytest.raises(InputError, match="0 of 2"):
        choose_device(path, product=1)
    assert choose_device(esi(tmp_path, HEAD + DEVICE + DEVICE + TAIL)).product == 0x1234
    twins = DEVICE + DEVICE.replace("#x1400", "#x1500")
    with pytest.raises(InputError, match="not the same each time"):
        choose_device(esi(tmp_path, HEAD + twins + TAIL))


BOMB = (
    '<?xml version="1.0"?><!DOCTYPE z [<!ENTITY a "aaaaaaaaaa">'
    + "".join(
        f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefgh", "bcdefghi", strict=True)
    )
    + "]><EtherCATInfo>&i;</EtherCATInfo>"
)
FILE = (
    '<?xml version="1.0"?><!DOCTYPE z [<!ENTITY a SYSTEM "file:///etc/passwd">]>'
    "<EtherCATInfo><Vendor><Id>&a;</Id></Vendor></EtherCATInfo>"
)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (BOMB, "not a usable ESI file"),
        (FILE, "document type"),
        ("", "not a usable"),
        (HEAD + DEVICE, "not a usable"),
        ("<html/>", "starts with 'html'"),
        (HEAD + TAIL, "describes 0 devices"),
        (HEAD.replace("4919", "sixteen") + DEVICE + TAIL, "'sixteen', which is not a number"),
        (HEAD + DEVICE.replace("<BitLen>24<", "<BitLen>256<") + TAIL, "256 bits"),
        (HEAD + DEVICE.replace("<BitLen>24<", "<BitLen>-1<") + TAIL, "not a number"),
        (HEAD + DEVICE.replace("<Index>#x1A00", '<Index DependOnSlot="1">#x1A00') + TAIL, "slot"),
        (HEAD + DEVICE.replace("</Type>", "</Type><Type/>") + TAIL, "2 elements Type"),
        (HEAD + "<a>" * 300 + "</a>" * 300 + TAIL, "not a usable"),
    ],
)
def test_refuses_hostile_files_in_a_sentence(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        choose_device(esi(tmp_path, text))


@pytest.mark.parametrize("encoding", ["latin-1", "cp037"])
def test_refuses_another_encoding_than_the_declared_one(tmp_path: Path, encoding: str) -> None:
    """The declared encoding is UTF-8; the name has an umlaut."""
    path = esi(tmp_path, HEAD + DEVICE.replace("finder", "f\xfcnder") + TAIL, encoding)
    with pytest.raises(InputError, match="not a usable ESI file"):
        choose_device(path)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (">MBoxIn<", ">Unused<", "0 sync managers for the mailbox in"),
        ('DefaultSize="128" StartAddress="#x1000"', 'StartAddress="#x1000"', "not state the size"),
        ("#x0300", "#x0000", "no mode with SYNC0"),
        ("INT24", "STRING(3)", "not a number that is known"),
        ("#x1400", "#x0F00", "not in the memory"),
        ("<Index>#x6030", "<Index>#x0005", "0x0005"),
    ],
)
def test_refuses_what_no_description_can_hold(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    assert old in DEVICE
    found = choose_device(esi(tmp_path, HEAD + DEVICE.replace(old, new) + TAIL))
    with pytest.raises(InputError, match=words):
        describe_esi(found, STATED)


def test_ships_no_esi_of_others() -> None:
    assert [path.name for path in resource("ethercat").glob("*.xml")] == ["ocmm_camera.xml"]
