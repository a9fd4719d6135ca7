"""What one system does otherwise than another: locks, folders on the disk, rights, processors.

In: descriptors, paths and numbers. Out: the same promise on Linux and on Windows, or the next best,
which `_host` names with its price. No other room asks which system it is on.

Read `_host` (what there is), then `_posix`; `_windows` was never run on Windows. It must not know
what is in the files.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.host._chosen import HOST, is_loopback, require_linux
    from ocmm_core.host._display import display_answers, library_fault
    from ocmm_core.host._host import Host
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["HOST", "Host", "display_answers", "is_loopback", "library_fault", "require_linux"]
