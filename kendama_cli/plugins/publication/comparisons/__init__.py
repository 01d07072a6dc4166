"""Chapters of a comparison of runs, one a stage, for the entry point group ``kendama.comparisons``."""
