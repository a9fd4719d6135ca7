"""Pictures of the machine at work: the camera images and the 3-D view."""
