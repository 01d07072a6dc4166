"""Checks that grade the exercises: ``exercise_N.CHECKS`` has one function for each task, by the task's number."""
