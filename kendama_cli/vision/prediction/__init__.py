"""Prediction of a flying ball and of the catch pose."""
