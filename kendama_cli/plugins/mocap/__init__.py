"""Swings that a motion capture system recorded, or streams now."""
