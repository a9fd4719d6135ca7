"""The measuring core of OCMM: cameras on a bus to toleranced features, without a screen."""

__version__ = "0.1.0"
