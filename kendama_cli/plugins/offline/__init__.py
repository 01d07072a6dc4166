"""Policies from four minutes of recorded swings: models are fitted, and a policy is learned in each model alone."""
