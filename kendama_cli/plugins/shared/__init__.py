"""Code that several parts need and the core does not; a part may import it, and it imports no part."""
