"""Demonstrations and games as LeRobot datasets."""
