"""The pages of a run that goes on."""
