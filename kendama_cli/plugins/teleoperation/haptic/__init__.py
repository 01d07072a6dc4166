"""A haptic device across the network: its pose moves the cup, and the hand feels rope and ball at 1 kHz."""
