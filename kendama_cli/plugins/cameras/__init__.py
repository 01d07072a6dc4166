"""Live and recorded cameras, and a look through any."""
