"""Parts of the installed program besides OCMM: its entry points and its compiled kernels."""
