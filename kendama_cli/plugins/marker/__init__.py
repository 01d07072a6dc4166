"""Swings of a cup with a printed square marker on its handle."""
