"""The whole loop and single games in MuJoCo: arms with their own actuators, and logged games played again."""
