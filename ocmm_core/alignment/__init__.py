"""The part frame from measured features."""
