"""A run as a page on this machine while it goes on: how far its stages are, and what their logs say by then."""
