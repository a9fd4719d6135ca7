"""Servers for programs of other makers.

In: commands of a measuring program over TCP and touches of the operator, or the live stream and the
jobs of a station. Out: measured points with a job next to every session; lines of points; state and
results by OPC UA and MQTT.

Read `ippdme` (I++ DME, VDMA 8722) and `lines`, then `published` (facts of a station) with `opcua`
and `mqtt`; `site` has the options of all. Their commands are entry points of `ocmm.commands`;
nothing imports this package.
"""

__all__: list[str] = []
