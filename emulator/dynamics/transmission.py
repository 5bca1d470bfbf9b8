"""The transmission between motor and joint: rigid or elastic, with a gap, and not quite of constant ratio."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import copysign, cos, inf, isinf, sin

import mujoco
import numpy as np

from drivetwin.emulator.dynamics.place import Place
from drivetwin.emulator.dynamics.records import records
from drivetwin.foundation.cached import cached_property
from drivetwin.foundation.compiled import in_place


@dataclass(frozen=True)
class Transmission:
    """Everything on the joint side: q of the joint, m of the motor (its angle by the gear ratio), e the transmission error.

    e(m) = error_amplitude sin(error_order gear m + error_phase); twist = m + e(m) - q.
    Rigid (infinite stiffness): the twist is 0. Elastic: the motor turns by itself, and the torque through the transmission is
    stiffness (|twist| - gap/2) sgn(twist) + damping d(twist)/dt in contact, which never pulls, and 0 inside the gap.
    `motor_friction_share`: of the axis's friction, the share that then acts on the motor (bearings and mesh of the gear).
    N·m/rad, N·m·s/rad, rad (N/m, N·s/m, m).
    """

    stiffness: float = inf
    damping: float = 0.0
    gap: float = 0.0
    error_amplitude: float = 0.0
    error_order: float = 1.0
    error_phase: float = 0.0
    motor_friction_share: float = 0.0

    @cached_property
    def record(self) -> np.void:
        """As compiled code reads it."""
        found: np.void = records((Transmission,), [(self,)])[0]
        return found

    @property
    def elastic(self) -> bool:
        """Whether the motor moves by itself."""
        return not isinf(self.stiffness)

    @property
    def acts(self) -> bool:
        """Whether it is more than a rigid gear of constant ratio."""
        return self.elastic or self.error_amplitude != 0.0

    def in_series(self, stiffness: float, damping: float, motor_friction_share: float) -> Transmission:
        """With another spring and damper behind it: compliances add, and so do the losses of slow twisting.

        Only friction behind both of them stays on the load.
        """
        before = max(self.motor_friction_share, motor_friction_share)
        if not self.elastic:
            return replace(self, stiffness=stiffness, damping=damping, motor_friction_share=before)
        together = 1.0 / (1.0 / self.stiffness + 1.0 / stiffness)
        losses = self.damping / self.stiffness**2 + damping / stiffness**2
        return replace(self, stiffness=together, damping=losses * together**2, motor_friction_share=before)


@in_place
def apply_elastic(rows, position, velocity, applied) -> None:  # type: ignore[no-untyped-def]  # record arrays have no static type
    """Add the torque through elastic transmissions to what acts on motors and joints in the coming step."""
    for row in range(rows.shape[0]):
        t = rows[row]
        wave = t.error_order * t.gear
        angle = wave * position[t.motor_qpos] + t.error_phase
        ratio = 1.0 + t.error_amplitude * wave * cos(angle)
        twist = position[t.motor_qpos] + t.error_amplitude * sin(angle) - position[t.qpos]
        torque = _through(t, twist, ratio * velocity[t.motor_dof] - velocity[t.dof])
        applied[t.motor_dof] -= ratio * torque
        applied[t.dof] += torque


@in_place
def _untwisted(t, q):  # type: ignore[no-untyped-def]
    """Motor position m where m + e(m) is q: Kepler's equation, by Newton from the start of Danby and Burkardt 1983."""
    if t.error_amplitude == 0.0:
        return q
    wave = t.error_order * t.gear
    steep, mean = t.error_amplitude * wave, wave * q + t.error_phase
    angle = mean - 0.85 * steep * copysign(1.0, sin(mean))
    for _ in range(6):
        angle -= (angle + steep * sin(angle) - mean) / (1.0 + steep * cos(angle))
    return q + (angle - mean) / wave


@in_place
def _relax(rows, position) -> None:  # type: ignore[no-untyped-def]
    """Turn the motors to where nothing is twisted."""
    for row in range(rows.shape[0]):
        t = rows[row]
        position[t.motor_qpos] = _untwisted(t, position[t.qpos])


@in_place
def _through(t, twist, rate):  # type: ignore[no-untyped-def]
    """Torque through the transmission: teeth in contact push, and never pull."""
    if t.gap == 0.0:
        return t.stiffness * twist + t.damping * rate
    if twist > 0.5 * t.gap:
        return max(0.0, t.stiffness * (twist - 0.5 * t.gap) + t.damping * rate)
    if twist < -0.5 * t.gap:
        return min(0.0, t.stiffness * (twist + 0.5 * t.gap) + t.damping * rate)
    return 0.0


@in_place
def apply_uneven(rows, links, position, velocity, torque, armature, simple, applied) -> None:  # type: ignore[no-untyped-def]
    """Lagrange with m(q): torque and rotor act by the slope dm/dq, and the rotor's inertia changes on the way.

    MuJoCo takes the inertia of `simple` joints, on which nothing else hangs, from dof_M0: that of `links` (n,) and the rotor.
    """
    for row in range(rows.shape[0]):
        t = rows[row]
        wave = t.error_order * t.gear
        angle = wave * _untwisted(t, position[t.qpos]) + t.error_phase
        slope = 1.0 / (1.0 + t.error_amplitude * wave * cos(angle))
        curvature = t.error_amplitude * wave * wave * sin(angle) * slope**3
        torque[t.actuator] *= slope
        armature[t.dof] = t.motor_inertia * slope * slope
        simple[t.dof] = links[row] + armature[t.dof]
        applied[t.dof] -= t.motor_inertia * slope * curvature * velocity[t.dof] ** 2


@in_place
def read_uneven(rows, position, angle) -> None:  # type: ignore[no-untyped-def]
    """Take the error off the motor angles that a constant ratio gives."""
    for row in range(rows.shape[0]):
        t = rows[row]
        angle[t.axis] += t.gear * (_untwisted(t, position[t.qpos]) - position[t.qpos])


class ElasticTransmissions:
    """The transmissions whose motor moves by itself; `rows` for `apply_elastic`."""

    def __init__(self, transmissions: Sequence[tuple[Transmission, Place]], data: mujoco.MjData) -> None:
        self.rows = records((Transmission, Place), transmissions)
        _relax(self.rows, data.qpos)


class UnevenTransmissions:
    """The rigid transmissions with a transmission error; `rows` and `links` for `read_uneven` and `apply_uneven`."""

    def __init__(self, transmissions: Sequence[tuple[Transmission, Place]], model: mujoco.MjModel) -> None:
        self.rows = records((Transmission, Place), transmissions)
        self.links = model.dof_M0[self.rows["dof"]] - self.rows["motor_inertia"]
        self._model = model

    def take_links(self) -> None:
        """Take over what hangs on the joints: dof_M0 was computed anew, with the armatures as they are now."""
        dofs = self.rows["dof"]
        self.links[:] = self._model.dof_M0[dofs] - self._model.dof_armature[dofs]
