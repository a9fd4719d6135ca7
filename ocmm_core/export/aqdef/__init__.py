"""Values for statistics in the Q-DAS ASCII transfer format.

In: the frozen data of one or several reports. Out: the bytes of one ``.dfq`` file.

Read `_aqdef` (the exporter and the values), `_head` (what stands above them, and the catalogues),
`_keys` (the published types and lengths, and how a text is made to fit), `_reader`.
It gets its data from `export.report` and must not open a job by itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ocmm_core.door import door

if TYPE_CHECKING:
    from ocmm_core.export.aqdef._aqdef import AQDEF
else:
    __getattr__ = door(__name__, _aqdef="AQDEF")

__all__ = ["AQDEF"]
