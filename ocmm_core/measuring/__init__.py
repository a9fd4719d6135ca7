"""Tips to measured points, or the reason why there is none."""
