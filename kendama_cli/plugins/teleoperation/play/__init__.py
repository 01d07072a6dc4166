"""A person plays in the browser: the page, its server, the simulated ball, and the tries that are kept.

The page sends what the hand did, stamped by the browser's own clock; the simulation advances by exactly that time, so a
message that comes late delays the picture and never bends the recording. One process serves all players.
"""
