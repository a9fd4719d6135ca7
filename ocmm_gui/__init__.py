"""The window of OCMM: it shows what the core says, passes commands on, and knows nothing more."""
