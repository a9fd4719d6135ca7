"""Limits of fits against limits that handbooks print (ISO 286-2), micrometres."""

from __future__ import annotations

import pytest

from ocmm_cad.drawing._context import RefusedError
from ocmm_cad.drawing._sizes import fit_limits


@pytest.mark.parametrize(
    ("code", "size", "low", "high"),
    [
        ("H7", 25.0, 0, 21), ("g6", 25.0, -20, -7), ("f7", 25.0, -41, -20), ("h6", 25.0, -13, 0),
        ("k6", 25.0, 2, 15), ("m6", 25.0, 8, 21), ("n6", 25.0, 15, 28), ("p6", 25.0, 22, 35),
        ("K7", 25.0, -15, 6), ("M7", 25.0, -21, 0), ("N7", 25.0, -28, -7), ("P7", 25.0, -35, -14),
        ("N9", 25.0, -52, 0), ("P9", 25.0, -74, -22), ("E8", 25.0, 40, 73), ("D9", 25.0, 65, 117),
        ("js6", 25.0, -6.5, 6.5), ("JS7", 50.0, -12.5, 12.5), ("h11", 100.0, -220, 0),
        ("F8", 10.0, 13, 35), ("G7", 18.0, 6, 24), ("K7", 3.0, -10, 0), ("M7", 5.0, -12, 0),
        ("M6", 300.0, -41, -9), ("H8", 500.0, 0, 97), ("d9", 120.0, -207, -120), ("H7", 3.0, 0, 10),
        ("H7", 3.001, 0, 12), ("k8", 40.0, 0, 39), ("P6", 30.0, -31, -18), ("N9", 2.0, -29, -4),
    ],
)  # fmt: skip
def test_limits_are_those_that_are_printed(code: str, size: float, low: float, high: float) -> None:
    lower, upper, is_hole = fit_limits(code, size)
    assert (1e3 * lower, 1e3 * upper) == pytest.approx((low, high), abs=1e-9)
    assert is_hole == code[0].isupper()


@pytest.mark.parametrize("code", ["H12", "H4", "r6", "Hh7", "X", "", "7H", "K9", "Js6", "H7/g6"])
def test_what_the_tables_do_not_have_is_refused_by_its_code(code: str) -> None:
    with pytest.raises(RefusedError, match=f"the fit {code}"):
        fit_limits(code, 20.0)


@pytest.mark.parametrize("size", [0.0, -5.0, 500.1])
def test_sizes_beyond_the_tables_are_refused(size: float) -> None:
    with pytest.raises(RefusedError, match="up to 500 mm"):
        fit_limits("H7", size)
