"""Balls in films of one's own: trained by boxes or found by a network, and tracked."""
