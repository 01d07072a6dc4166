"""kendama: robot learning for the ball-in-a-cup game."""

__version__ = "0.1.0"
