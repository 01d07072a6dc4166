"""Pages that this machine serves to its own browser, and to those that the user lets in."""
