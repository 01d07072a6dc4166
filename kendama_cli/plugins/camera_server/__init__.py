"""Cameras of another machine, or of another process: a server that sends their images, and its other end."""
