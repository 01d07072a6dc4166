"""Recordings of tracked bodies: what motion capture systems and robots write."""
