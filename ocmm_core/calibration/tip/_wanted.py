"""Default validity of a tip, for commands to show without loading the package."""

VALID_DAYS = 30
