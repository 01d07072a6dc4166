"""Default colours of rendered bodies, red green blue as screens show it."""

Rgb = tuple[float, float, float]
SHELL_RGB, JOINT_RGB, STAND_RGB = (0.86, 0.87, 0.89), (0.30, 0.32, 0.36), (0.62, 0.64, 0.67)
CUP_RGB, BALL_RGB = (0.0, 0.447, 0.698), (0.835, 0.369, 0.0)
