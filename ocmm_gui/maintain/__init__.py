"""The Maintain mode: what keeps the machine in order, one page for each subject."""
