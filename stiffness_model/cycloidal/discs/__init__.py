"""Single discs between pins, rollers and crank: contacts -> energy -> its minimum -> forces and torques there."""
