"""The physics of dm_control's ``ball_in_cup`` (suite/ball_in_cup.xml, Apache-2.0) as plain MJCF, without its looks."""

from __future__ import annotations

import itertools

_PROFILE = ((-0.05, 0.0), (-0.05, -0.075), (-0.025, -0.1), (0.025, -0.1), (0.05, -0.075), (0.05, 0.0))
"""Corners of the cup in its plane, x and z [m]; a capsule runs from each to the next."""
_CUP = "\n      ".join(
    f'<geom type="capsule" size=".008" fromto="{x0} 0 {z0} {x1} 0 {z1}"/>'
    for (x0, z0), (x1, z1) in itertools.pairwise(_PROFILE)
)
BALL_IN_CUP = f"""
<mujoco model="ball in cup">
  <option timestep="0.002"/>
  <default>
    <motor ctrllimited="true" ctrlrange="-1 1" gear="5"/>
    <default class="cup"><joint type="slide" damping="3" stiffness="20"/></default>
  </default>
  <worldbody>
    <geom name="ground" type="plane" pos="0 0 0" size=".6 .2 10"/>
    <body name="cup" pos="0 0 .6" childclass="cup">
      <joint name="cup_x" axis="1 0 0"/>
      <joint name="cup_z" axis="0 0 1"/>
      {_CUP}
      <site name="cup" pos="0 0 -.108" size=".005"/>
    </body>
    <body name="ball" pos="0 0 .2">
      <joint name="ball_x" type="slide" axis="1 0 0"/>
      <joint name="ball_z" type="slide" axis="0 0 1"/>
      <geom name="ball" type="sphere" size=".025"/>
      <site name="ball" size=".005"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="x" joint="cup_x"/>
    <motor name="z" joint="cup_z"/>
  </actuator>
  <tendon>
    <spatial name="string" limited="true" range="0 0.3" width="0.003">
      <site site="ball"/>
      <site site="cup"/>
    </spatial>
  </tendon>
</mujoco>
"""
