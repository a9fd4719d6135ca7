"""The camera model and the rig: world to pixel and back."""
