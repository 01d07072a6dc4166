"""Models of cameras: lenses, regions, and points in space from their pixels."""
