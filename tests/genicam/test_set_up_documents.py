"""Documents of the makes, on features of cameras as their public node maps list them."""

from __future__ import annotations

from typing import cast

import pytest

from ocmm_genicam._client import Camera
from ocmm_genicam._set_up import _documents, documents_for, lost_by, ptp_names

_IMAGE = "WidthMax HeightMax Width Height OffsetX OffsetY PixelFormat ReverseX ReverseY "
_MAPS = {
    # The Imaging Source DMK 33GX174 (areaDetector ADGenICam, xml/TIS_33GX174.xml).
    "The Imaging Source Europe GmbH DMK 33GX174": _IMAGE
    + "BlackLevel GainAuto Gain SensorWidth ChunkModeActive ActionDeviceKey ActionGroupKey "
    "DeviceTemperature TimestampLatchValue TriggerMode TriggerSource TriggerOverlap ExposureAuto "
    "ExposureTime IMX174HardwareWDREnable IMX174HardwareWDRShutterMode AcquisitionFrameRate "
    "AcquisitionMode GPIn GPOut",
    # Allied Vision Manta G-235B (xml/AVT_Manta_G235B.xml).
    "Allied Vision Technologies Manta_G-235B": _IMAGE
    + "AcquisitionMode AcquisitionFrameRateAbs TriggerMode TriggerSource TriggerDelayAbs "
    "GevTimestampTickFrequency PtpMode PtpStatus PtpAcquisitionGateTime BinningHorizontal "
    "BinningVertical DecimationHorizontal ExposureAuto ExposureMode ExposureTimeAbs GainAuto Gain "
    "BlackLevel Gamma DefectMaskColumnEnable SyncInLevels ChunkModeActive StreamBytesPerSecond",
    # FLIR Blackfly S 13Y3M (xml/FLIR-BFS-PGE-13Y3M.xml, its head).
    "Point Grey Research Blackfly S BFS-PGE-13Y3M": _IMAGE
    + "GevIEEE1588 GevIEEE1588Status GevIEEE1588Mode GevIEEE1588ClockAccuracy ExposureAuto "
    "ExposureTime GainAuto Gain GammaEnable IspEnable TriggerMode LineStatusAll "
    "AcquisitionFrameRateEnable AcquisitionFrameRate AdcBitDepth",
    # Basler a2A2600-20gmBAS (GenICamApp/Db/Basler-a2A2600-20gmBAS.template, its head).
    "Basler a2A2600-20gmBAS": _IMAGE
    + "BinningHorizontal BinningVertical TestPattern BslMultipleROIRowsEnable ExposureAuto "
    "ExposureMode ExposureTime AcquisitionMode SensorShutterMode TriggerMode LineStatusAll "
    "PtpEnable PtpStatus PtpOffsetFromMaster PtpGrandmasterClockID PtpDataSetLatch",
    # Mikrotron MC206xS11 (xml/Mikrotron_CXP_MC206xS11.xml).
    "Mikrotron_GmbH MC206xS11": _IMAGE
    + "AcquisitionMode TriggerSelector TriggerMode TriggerSource TestImageSelector ExposureMode "
    "ExposureTime AcquisitionFrameRate AcquisitionFrameRateMax UserSetSelector UserSetSave "
    "UserSetDefaultSelector InfoFieldFrameCounterEnable InfoFieldTimeStampEnable "
    "InfoFieldRoiEnable FixedPatternNoiseReduction",
    # Vieworks VNP-604 (xml/ViewWorks_VNP604.xml, its head).
    "Vieworks VNP-604MX": _IMAGE
    + "SensorWidth SensorHeight BinningHorizontal BinningVertical TestPattern "
    "DefectivePixelCorrection DynamicDefectivePixelCorrection AcquisitionMode "
    "AcquisitionFrameRate TriggerMode ExposureMode ExposureTime Gain BlackLevel LUTEnable "
    "HotPixelCorrection FlatFieldCorrection StageMode MultishotEnable CalibrationAuto "
    "SequencerMode UserSetDefault TimestampLatch",
    # LUCID Triton: names that public programs set by Arena.
    "Lucid Vision Labs TRI032S-M": _IMAGE
    + "PtpEnable PtpSlaveOnly PtpStatus PtpDataSetLatch PtpOffsetFromMaster "
    "PtpGrandmasterClockID AcquisitionStartMode PTPSyncFrameRate AcquisitionFrameRate "
    "AcquisitionFrameRateEnable ExposureAuto ExposureTime GainAuto Gain GammaEnable LUTEnable "
    "DefectCorrectionEnable TriggerMode GevSCFTD",
}


class _NodeMap:
    """Has the features of a list, and nothing else."""

    def __init__(self, model: str) -> None:
        self.model, self._names = model, frozenset(_MAPS[model].split())

    def has(self, feature: str) -> bool:
        return feature in self._names


@pytest.mark.parametrize(
    ("model", "settings", "enable", "lost"),
    [
        (
            "The Imaging Source Europe GmbH DMK 33GX174",
            {"IMX174HardwareWDREnable": "false", "ExposureAuto": "Off", "ReverseX": "false"},
            "",
            ("cannot be proven", "offset of its clock"),
        ),
        (
            "Allied Vision Technologies Manta_G-235B",
            {"Gamma": "1", "DecimationHorizontal": "1", "ExposureMode": "Timed"},
            "PtpMode",
            ("offset of its clock",),
        ),
        (
            "Point Grey Research Blackfly S BFS-PGE-13Y3M",
            {"IspEnable": "false", "GammaEnable": "false"},
            "GevIEEE1588",
            ("offset of its clock",),
        ),
        (
            "Basler a2A2600-20gmBAS",
            {"BslMultipleROIRowsEnable": "false", "TestPattern": "Off"},
            "PtpEnable",
            (),
        ),
        (
            "Mikrotron_GmbH MC206xS11",
            {"InfoFieldFrameCounterEnable": "false", "InfoFieldRoiEnable": "false"},
            "",
            ("cannot be proven", "offset of its clock"),
        ),
        (
            "Vieworks VNP-604MX",
            {"StageMode": "Off", "DynamicDefectivePixelCorrection": "false", "LUTEnable": "false"},
            "",
            ("cannot be proven", "offset of its clock"),
        ),
        (
            "Lucid Vision Labs TRI032S-M",
            {"DefectCorrectionEnable": "false", "GammaEnable": "false"},
            "PtpEnable",
            (),
        ),
    ],
)
def test_what_a_camera_gets_and_what_is_lost_by_it(
    model: str, settings: dict[str, str], enable: str, lost: tuple[str, ...]
) -> None:
    camera = cast("Camera", _NodeMap(model))
    wanted = {
        one.feature: one.value
        for document in documents_for(model)
        for one in document.settings
        if camera.has(one.feature)
    }
    assert settings.items() <= wanted.items()
    names = ptp_names(camera)
    assert ("" if names is None else names.enable) == enable
    found = lost_by(camera)
    assert len(found) == len(lost)
    assert all(part in sentence for part, sentence in zip(lost, found, strict=True))


def test_ten_makes_have_documents() -> None:
    makes = {document.make for document in _documents()}
    assert len(makes - {""}) == 10


def test_a_make_of_which_nothing_is_known_gets_the_names_of_the_standard() -> None:
    (document,) = documents_for("Nobody Camera 1")
    assert document.make == ""
    assert len(document.settings) > 15
