"""First attempts at a motion on an arm: checked, played by the twin, then by the arm, without the ball."""
