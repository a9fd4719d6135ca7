"""Shapes, their fits, and features as nominal and as measured."""
