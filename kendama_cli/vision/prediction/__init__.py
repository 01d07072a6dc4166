"""Prediction of a flying ball and of the place that catches it."""
