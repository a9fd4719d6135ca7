"""Dialects of the protocol and its table of errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from ocmm_serve.ippdme._grammar import call_text, quoted


class DmeDialect(StrEnum):
    """Edition of the protocol; the value is that of the command line."""

    V14 = "1.4"
    """I++ DME 1.4.3, as the public test suite of NIST judges it."""
    V25 = "2.5"
    """VDMA 8722:2024."""

    @property
    def version(self) -> str:
        return "1.4.3" if self is DmeDialect.V14 else "2.5"


@dataclass(frozen=True, slots=True)
class ErrorRow:
    severity: int
    text: str


_TABLE = """
0000 0 Buffer full
0001 2 Illegal tag
0002 2 No space at pos. 6
0003 2 Reserved
0004 2 Reserved
0005 2 Reserved
0006 2 Transaction aborted (Use ClearAllErrors to Continue)
0007 3 Illegal character
0008 3 Protocol error
0500 3 Emergency stop
0501 3 Unsupported command
0502 3 Incorrect arguments
0503 9 Controller communications failure
0504 1 Argument out of range
0505 3 Argument not recognized
0506 3 Argument not supported
0507 3 Illegal command
0508 3 Bad context
0509 3 Bad argument
0510 3 Bad property
0511 3 Error processing method
0512 1 No daemons are active
0513 2 Daemon does not exist
0514 2 Use ClearAllErrors to continue
0515 2 Daemon already exists
1000 3 Machine in error state
1001 2 Illegal touch
1002 9 Axis does not exist
1003 2 No touch
1004 9 Number of angles not supported on current device
1005 3 Error during home
1006 2 Surface not found
1007 3 Theta out of range
1008 3 Target position out of machine volume
1009 3 Air pressure out of range
1010 2 Vector has no norm
1500 3 Failed to re-seat head
1501 3 Probe not armed
1502 3 Tool not found
1503 3 Tool not defined
2000 3 Tool not calibrated
2001 2 Head error excessive force
2002 3 Type of probe does not allow this operation
2500 3 Machine limit encountered [Move Out Of Limits]
2501 3 Axis not active
2502 3 Axis position error
2503 9 Scale read head failure
2504 3 Collision
2505 2 Specified angle out of range
2506 2 Part not aligned
"""
_ADDED = """
0006 2 Transaction aborted (Use ClearAllErrors To Continue)
1011 2 Unable to move
1012 2 Bad lock combinations
1013 3 Coordinate system not found
1014 2 Failed to set value due to active internal correction
1504 3 Collection not found
1505 2 Tool not alignable
1506 1 Tool property not applicable
1507 3 Tool not alignable to given orientation
2003 3 Raw data not available
2004 3 No shared memory
2005 3 File not found
5000 2 Wrong data format
5001 2 Port not available
8000 0 SIMULATED
"""


def _rows(table: str) -> dict[int, ErrorRow]:
    rows = (line.split(" ", 2) for line in table.strip().splitlines())
    return {int(number): ErrorRow(int(severity), text) for number, severity, text in rows}


ERRORS: Mapping[DmeDialect, Mapping[int, ErrorRow]] = {
    DmeDialect.V14: _rows(_TABLE),
    DmeDialect.V25: {**_rows(_TABLE), **_rows(_ADDED)},
}


def error_line(dialect: DmeDialect, tag: str, number: int, where: str) -> str:
    """Return the line of an error, with the text and the severity of the table."""
    row = ERRORS[dialect][number]
    values = (f"{row.severity}", f"{number:04d}", quoted(where) if where else '""')
    return f"{tag} ! {call_text('Error', *values, quoted(row.text))}"
