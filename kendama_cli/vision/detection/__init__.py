"""Detection of the ball in one image."""
