"""Swings that a person makes at a distance: in the browser, or with a haptic device across the network."""
