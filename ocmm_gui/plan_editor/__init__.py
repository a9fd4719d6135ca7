"""A plan is written in the window: features, characteristics, alignment, pictures."""
