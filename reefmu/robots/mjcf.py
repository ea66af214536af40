"""The model of one joint as an MJCF file: what a robot's model needs for the drive, in a model that runs."""

from __future__ import annotations

from collections.abc import Mapping
from xml.sax.saxutils import escape, quoteattr

from reefmu.model.masses import Masses

from .twist_inertia import SAFE_PHASE


def joint_model(
    plugin: str,
    ratio: float,
    masses: Masses,
    step: float,
    armature: float,
    attributes: Mapping[str, tuple[float, str]],
) -> str:
    """An MJCF model of motor, drive and load, without gravity, with comments on what to copy.

    plugin: its name. step: time step, s; armature: of the twist, kg.m2. attributes: configuration attributes of the
    drive with their values and units. The load's inertia is that about the axis.
    """
    settings = "".join(
        f"        <config key={quoteattr(name)} value={quoteattr(f'{value:g}')}/>  <!-- {escape(unit)} -->\n"
        for name, (value, unit) in attributes.items()
    )
    reflected, damping = masses.motor_inertia * ratio**2, masses.motor_damping * ratio**2
    # MuJoCo expects of principal inertias that none exceeds the sum of the two others.
    inertia = " ".join(f"{masses.load_inertia:.9g}" for _ in range(3))
    return f"""<mujoco model={quoteattr(plugin)}>
  <!-- The drive {escape(plugin)} between a motor and a load. Load its library first (mj_loadPluginLibrary).
       For a joint of your own: copy <extension>, in the joint's body the second joint and <plugin>, and the attribute
       armature of the first joint (motor inertia x ratio^2). The drive takes the last two joints of its body.
         joint        the motor's angle/ratio; actuators, limits and sensors stay on it
         joint_twist  minus the twist of the drive; the link turns with the sum of both
       armature of joint_twist: time step^2 x greatest stiffness/{SAFE_PHASE:g}, stable for any robot at this time step.
       With the inertia at the joint known, less is more accurate: reefmu.robots.twist_armature. -->
  <option timestep="{step:g}" gravity="0 0 0"/>
  <extension>
    <plugin plugin={quoteattr(plugin)}>
      <instance name="joint_drive">
{settings}      </instance>
    </plugin>
  </extension>
  <worldbody>
    <body name="load">
      <inertial pos="0 0 0" mass="1" diaginertia="{inertia}"/>
      <joint name="joint" type="hinge" axis="0 0 1" armature="{reflected:.9g}" damping="{damping:.9g}"/>
      <joint name="joint_twist" type="hinge" axis="0 0 1" armature="{armature:.9g}"/>
      <plugin instance="joint_drive"/>
    </body>
  </worldbody>
  <actuator>
    <!-- ctrl: torque of the motor on the crank, N.m -->
    <motor name="motor" joint="joint" gear="{ratio:.9g}"/>
  </actuator>
  <sensor>
    <!-- the drive's outputs, in the order of "outputs" in drive.json; optional -->
    <plugin name="joint_drive" instance="joint_drive"/>
  </sensor>
</mujoco>
"""
