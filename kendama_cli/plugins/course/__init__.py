"""The course: eight exercises as notebooks, what grades them, and the board on which learners are ranked."""
