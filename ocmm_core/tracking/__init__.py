"""Spots to labelled targets, pose and tip."""
