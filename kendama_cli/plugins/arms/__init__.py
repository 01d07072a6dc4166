"""An arm before it plays: its description, where it should stand, the check of a motion, and recovery."""
