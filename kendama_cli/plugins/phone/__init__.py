"""Swings that a phone's accelerometer and gyroscope recorded: the phone is the cup."""
