"""The bench of whoever builds this product or a camera for it.

In: a build, or a camera on a line. Out: tables of losses, and verdicts on rules.

Read `campaign` (`ocmm selftest reliability`: kills, power cuts, bad disks, hostile files) and
`conform` (`ocmm camera conform`: a camera against its object description). Both register commands
(`ocmm.commands`); nothing imports them.
"""

__all__: list[str] = []
