"""Part frames from measured features."""
