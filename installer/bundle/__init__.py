"""What the installed program has besides OCMM: its entry points and the kernels compiled for it."""
