"""Frames from any source, with every cycle accounted for."""
