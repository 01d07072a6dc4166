"""Laws of the ball and its rope that many floors share, each defined once: plain numbers in, plain numbers out."""
