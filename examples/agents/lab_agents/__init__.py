"""Agents that know Gymnasium's interface and nothing of kendama."""
