"""KUKA's RobotSensorInterface: a controller tells every 4 ms where the arm is, and is told how much to correct."""
