"""Camera bus in a separate process: program, rights, and client.

In: a configuration as JSON, and requests for objects of cameras, line by line.
Out: frames in the shared ring, the bus report, replies, and the reason for stopping.

In the process: `_start` (single thread, least rights), `_process` (the program ``ocmm-acq``),
`_ethercat` (one read per bus cycle), `_commands`, `_rights`; `_errands` is another program, for
short tasks (`run_errand`).

In the application: `_launch`, `_client` (as a child, or as a service), `_remote_objects`.

It must not import tracking or later packages: a crash there must not stop the bus.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_core.acquisition.bus_process._client import (
        Acquisition, BusProcess, ChildProcess, ServiceBus,
    )  # fmt: skip
    from ocmm_core.acquisition.bus_process._commands import (
        read_first_line, run_errand, send_line, stopped_by_parent,
    )  # fmt: skip
    from ocmm_core.acquisition.bus_process._errands import (
        MaintenanceConfig, MaintenanceNews, RecordConfig, ScanConfig,
    )  # fmt: skip
    from ocmm_core.acquisition.bus_process._ethercat import EthercatSource
    from ocmm_core.acquisition.bus_process._launch import (
        RECIPE, BusConfig, ProcessConfig, WireErrand, bus_command, read_config,
    )  # fmt: skip
    from ocmm_core.acquisition.bus_process._process import SteppedTime
    from ocmm_core.acquisition.bus_process._remote_objects import RemoteObjects
    from ocmm_core.acquisition.bus_process._rights import (
        BUS_PRIORITY, CAMERA_PRIORITY, NEEDED, Capability, ProcessRights, allow_locked_memory,
        give_up_all_but, granted_by, hold_nothing, lock_memory, rights_of, take_priority,
    )  # fmt: skip
else:
    __getattr__ = lazy_exports(__name__)

__all__ = [
    "BUS_PRIORITY", "CAMERA_PRIORITY", "NEEDED", "RECIPE", "Acquisition", "BusConfig", "BusProcess",
    "Capability", "ChildProcess", "EthercatSource", "MaintenanceConfig", "MaintenanceNews",
    "ProcessConfig", "ProcessRights", "RecordConfig", "RemoteObjects", "ScanConfig", "ServiceBus",
    "SteppedTime", "WireErrand", "allow_locked_memory", "bus_command", "give_up_all_but",
    "granted_by", "hold_nothing", "lock_memory", "read_config", "read_first_line", "rights_of",
    "run_errand", "send_line", "stopped_by_parent", "take_priority",
]  # fmt: skip
