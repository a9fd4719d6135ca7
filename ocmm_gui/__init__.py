"""The window of OCMM: it shows what the core says, passes commands on, and knows nothing more.

In: snapshots of a station and of guided procedures, keys, clicks and foot switches.
Out: what is seen and heard, and commands to the core.

Read `app` (arguments in, a running window out) and `window`; under it `operator` (the inspector's
screens), `results`, `plan_editor`, `maintain`, `wizards`; under these `bridge` (to the station),
`charts`, `views`, `reports`; at the bottom `kit`. A room imports only rooms below it, and those of
one row do not know each other.
It must not know the commands of `ocmm`, nor the virtual rig.
"""

__all__: list[str] = []
