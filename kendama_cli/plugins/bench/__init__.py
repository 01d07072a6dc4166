"""A learner on tiles in environments of others."""
