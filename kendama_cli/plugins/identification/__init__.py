"""Measurements before a game: friction and servo of the joints, rope and drag of the kendama."""
