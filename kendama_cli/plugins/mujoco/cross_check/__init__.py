"""Another physics than ours: the ball on a chain of links in MuJoCo, the cup carried along a path that was logged."""
