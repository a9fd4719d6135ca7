"""Values for statistics in the Q-DAS ASCII transfer format.

In: the frozen data of one or several reports. Out: the bytes of one ``.dfq`` file.

Read `_aqdef` (the exporter and the values), `_head` (header and catalogues, published types and
lengths of keys, and fitting of texts; their reader).
Its data come from `export.report`; it must not open a job.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.export.aqdef._aqdef import AQDEF
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["AQDEF"]
