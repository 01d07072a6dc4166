"""Movement primitives outside of a run: shown, written, and drawn from."""
