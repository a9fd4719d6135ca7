"""OPC UA server of a station: state, results with U, calibrations, corrections; read-only.

In: `ocmm_serve.published`. Out: one machine after OPC 40001-1 and OPC 40001-101.

Read `_model` (the address space) and `_server` (certificates, addresses, bounds). `_command` is
`ocmm serve opcua`, an entry point of `ocmm.commands`; nothing imports this package. It runs in a
separate process, so that no client delays a measurement.
"""

from ocmm_core.lazy_exports import TYPE_CHECKING, lazy_exports

if TYPE_CHECKING:
    from ocmm_serve.opcua._command import serve_opcua
    from ocmm_serve.opcua._model import NAMESPACE, MachineModel
    from ocmm_serve.opcua._server import OpcUaServer, TrustedClients
else:
    __getattr__ = lazy_exports(__name__)

__all__ = ["NAMESPACE", "MachineModel", "OpcUaServer", "TrustedClients", "serve_opcua"]
