"""Balls in films of one's own: trained by boxes, and tracked."""
