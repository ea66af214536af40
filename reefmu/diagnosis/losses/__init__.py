"""What the drive loses between crank and output.

* `sliding_samples`: where friction at the crank slides, and to which cycle each sample belongs.
* `crank_losses`: from the torques of both ends the friction, its efficiencies and their intervals.
* `stated_friction`: the torque at the output from the motor's, less the friction that the drive states.
"""
