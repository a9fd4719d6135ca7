"""Servers for measuring programs of other makers.

In: commands of a client over TCP, and touches of the operator. Out: measured points, and a job file
next to every session.

Read `ippdme` (I++ DME, VDMA 8722). Its command is an entry point of `ocmm.commands`; nothing
imports this package.
"""

__all__: list[str] = []
