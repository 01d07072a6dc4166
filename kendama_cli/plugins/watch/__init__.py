"""A look at runs: the page of one that goes on, and what shows a log in Foxglove."""
