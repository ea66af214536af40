"""Errors of the rig's torque sensor, which change the reading and not the torque."""
