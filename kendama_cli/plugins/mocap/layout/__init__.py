"""Guessing how a recording is laid out, with the evidence for each guess."""
