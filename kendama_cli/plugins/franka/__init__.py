"""An arm of Franka Robotics by the Franka Control Interface (FCI)."""
