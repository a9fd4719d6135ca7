"""What is kept: job files that lose no point and change none."""
