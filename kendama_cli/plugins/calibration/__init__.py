"""Calibration of cameras: a board to print, lenses and poses from its views, delays, and poses in a robot's world."""
