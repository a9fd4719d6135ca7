"""The window of OCMM: it shows the core's state and passes commands on.

In: snapshots of a station and of guided procedures, keys, clicks and foot switches.
Out: display and sound, and commands to the core.

Read `app` (arguments in, a running window out) and `window`; under it `operator` (the inspector's
screens), `results`, `plan_editor`, `maintain`, `wizards`; under these `bridge` (to the station),
`charts`, `views`, `reports`; at the bottom `kit` and `rendering`. A package imports only lower
ones, and those of one row are independent.
It must not know the commands of `ocmm`, nor the virtual rig.
"""

__all__: list[str] = []
