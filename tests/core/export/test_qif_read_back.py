"""Comparison of a QIF file with the report by the reader, and omissions of the writer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from ocmm_core.errors import StorageError
from ocmm_core.export import preview, preview_text, write_report
from ocmm_core.export.qif._qif import QIF
from ocmm_core.export.qif._writer import NAMESPACE
from ocmm_core.export.report import polyworks_profile
from ocmm_core.export.report._json_file import _explanation
from ocmm_core.features.shapes import Shape
from ocmm_core.inspection.causes import Cause, CauseFinding, Explanation
from ocmm_core.tolerances.decisions import Verdict
from tests.core.export.sample_report import feature, point, sample_report, sample_view
from tests.core.export.test_export_qif import Q, everything

STANDARD = polyworks_profile()


def read_back(change: Callable[[etree._Element], None]) -> list[str]:
    """Return the reader's findings about the document after a change."""
    data = [sample_report()]
    ((name, content),) = QIF.contents(data, STANDARD).items()
    root = etree.fromstring(content)
    change(root)
    return QIF.differences(data, STANDARD, {name: etree.tostring(root)})


def results(root: etree._Element) -> list[etree._Element]:
    path = f".//{{{NAMESPACE}}}CharacteristicMeasurements/*"
    return root.findall(path)


def test_a_value_or_uncertainty_that_is_a_little_off_is_another_one() -> None:
    assert read_back(lambda root: None) == []

    def move(by: float) -> Callable[[etree._Element], None]:
        def change(root: etree._Element) -> None:
            value = results(root)[0].find(f"{Q}Value")
            assert value is not None
            value.text = repr(float(value.text or "") + by)

        return change

    def widen(root: etree._Element) -> None:
        value = results(root)[0].find(f"{Q}Value")
        assert value is not None
        value.set("combinedUncertainty", repr(float(value.get("combinedUncertainty", "")) * 1.01))

    for change in (move(1e-6), move(-0.5), widen):
        (fault,) = read_back(change)
        assert fault.endswith("has another value or uncertainty.")


def test_a_preview_has_six_digits_after_the_point() -> None:
    lengths = [
        word for word in preview_text(preview(sample_report(), "qif")).split() if "." in word
    ]
    digits = {len(word.partition(".")[2]) for word in lengths if word.partition(".")[2].isdigit()}
    assert 6 in digits
    assert max(digits) == 6


def test_only_coordinates_say_what_kind_of_coordinate_they_are() -> None:
    view, nominals = everything()
    data = sample_report(view, nominals=nominals)
    (content,) = QIF.contents([data], STANDARD).values()
    found = results(etree.fromstring(content))
    told = {
        etree.QName(one).localname for one in found if one.find(f"{Q}TypeOfCoordinates") is not None
    }
    assert told == {"LinearCoordinateCharacteristicMeasurement"}


def test_a_feature_with_points_and_no_element_has_no_set_of_points(tmp_path: Path) -> None:
    view = sample_view()
    touched = feature(
        "BALL", Shape.SPHERE, [point(9, "BALL", (0.0, 0.0, 1.0), (0.0, 0.0, 1.0))], None, []
    )
    data = sample_report(replace(view, features=(*view.features[:2], touched)))
    write_report(data, ("qif",), tmp_path, incomplete=True)


def test_form_is_told_where_there_are_more_points_than_the_shape_needs() -> None:
    (content,) = QIF.contents([sample_report()], STANDARD).values()
    root = etree.fromstring(content)
    forms = [one for one in root.iter("{*}*") if one.get("name") == "Form"]
    # The bore has four points, the face the three that it needs.
    (form,) = forms
    owners = [etree.QName(one).localname for one in form.iterancestors()]
    assert "CircleFeatureMeasurement" in owners


@pytest.mark.parametrize("beyond", [np.nan, np.inf])
def test_an_explanation_without_a_number_is_no_json(beyond: float) -> None:
    finding = CauseFinding(Cause.NOISE, (), (), "Check it.")
    explained = Explanation("Bore", Verdict.NOT_CONFORM, "mm", beyond, 0.01, "Why.", finding)
    with pytest.raises(StorageError):
        _explanation(explained)
    assert _explanation(replace(explained, beyond=None)).beyond is None
