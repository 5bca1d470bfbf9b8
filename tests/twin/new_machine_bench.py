"""Models small enough to be read, of which tests make machines."""

from __future__ import annotations

import sys
from math import pi
from pathlib import Path

import pytest

from drivetwin.cli import main

GANTRY = """<mujoco model="gantry"><compiler autolimits="true"/><worldbody>
<body name="bridge"><joint name="x" type="slide" axis="1 0 0" range="-0.3 0.3" armature="12" frictionloss="30" damping="90"/>
<inertial pos="0 0 0" mass="40" diaginertia="1 1 1"/>
<body name="quill"><joint name="z" type="slide" axis="0 0 1" {z}/><inertial pos="0 0 0" mass="6" diaginertia="1 1 1"/>
</body></body></worldbody><actuator><motor name="mx" joint="x" gear="{gear}"/>{servo}</actuator></mujoco>"""
PEAK_Z = 1.3 * 2.0 * (6.0 * 9.81 + 8.0)
ROTOR_Z = PEAK_Z * 2.0 * pi / 0.01 / 1e5
"""Of z, of which the model says nothing [N, kg]: peak force of its motor by the weight, and the rotor of such a motor."""
SERVO = '<position name="mz" joint="z" kp="5000" kv="100" {0}/>'


def gantry(folder: Path, servo: str = "", z: str = 'range="0 0.2" frictionloss="8"') -> Path:
    """Two slides; one on a screw of 20 mm a turn, the other with a servo and nothing said of its motor."""
    path = folder / "gantry.xml"
    path.write_text(GANTRY.format(gear=2.0 * pi / 0.02, servo=SERVO.format(servo), z=z), encoding="utf-8")
    return path


def run(monkeypatch: pytest.MonkeyPatch, *words: str | Path) -> int:
    monkeypatch.setattr(sys, "argv", ["drivetwin", *map(str, words)])
    try:
        main()
    except SystemExit as ended:
        return int(ended.code or 0)
    return 0


def made_gantry(folder: Path) -> Path:
    """A machine of the two slides."""
    with pytest.MonkeyPatch.context() as patch:
        assert run(patch, "machine", "new", gantry(folder), "--out", folder / "made", "--quiet") == 0
    return folder / "made"


FINGER = """<mujoco model="finger"><compiler angle="radian"/><worldbody><body>
<joint name="bend" axis="0 1 0" range="-1 1" {joint}/><inertial pos="0 0 0" mass="0.01" diaginertia="{0} {0} {0}"/>
</body></worldbody></mujoco>"""


def finger(folder: Path, inertia: float, joint: str) -> Path:
    """One light link."""
    path = folder / "finger.xml"
    path.write_text(FINGER.format(inertia, joint=joint), encoding="utf-8")
    return path
