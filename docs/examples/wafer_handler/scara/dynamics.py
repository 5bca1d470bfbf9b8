"""The arm's inverse dynamics in closed form: docs/wafer-handler.md, "Dynamics" (the paper's eq. 13 and 14).

Joints are (lift [m], rotate = theta2 [rad], stretch = theta3 [rad]), torques (N, N·m, N·m) on the joint side; belts are rigid.
Upper arm, forearm and blade turn at theta2' + theta3', theta2' - theta3' and theta2', so

    tau = M(theta3) q'' + C(theta3, q') q' + g,    M = [[m + Jm, 0, 0], [0, M22, M23], [0, M23, M33]]
    M22 = J2 - 2 (D cos 2 theta3 + D' sin 2 theta3) + 4 E sin theta3
    M33 = J3 + 2 (D cos 2 theta3 + D' sin 2 theta3)
    M23 = H - 2 E' cos theta3
"""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np

from drivetwin.identification.friction_law import FrictionLaw
from drivetwin.recording.recording import Samples
from wafer_handler.scara.geometry import Geometry
from wafer_handler.scara.link_parameters import LinkParameters

GRAVITY = 9.81
"""m/s²."""


@dataclass(frozen=True)
class BaseParameters:
    """All that the motion of the three axes can tell of the masses: nine combinations. PARAMETERS says what each is made of.

    `*_across` vanish where each body is symmetric to the line through its joints.
    """

    moving_mass: float
    lift_armature: float
    rotate_inertia: float
    stretch_inertia: float
    coupling_inertia: float
    forearm_moment: float
    forearm_moment_across: float
    blade_moment: float
    blade_moment_across: float

    def vector(self) -> Samples:
        """The parameters in the order of PARAMETERS, (9,)."""
        return np.array(astuple(self), dtype=np.float64)


@dataclass(frozen=True)
class ParameterMeaning:
    """How a base parameter is printed: field of BaseParameters, symbol, unit, and what it is made of."""

    name: str
    symbol: str
    unit: str
    meaning: str


PARAMETERS = (
    ParameterMeaning("moving_mass", "m", "kg", "m1 + m2 + m3 + m4 + m5"),
    ParameterMeaning("lift_armature", "Jm", "kg", "motor of the lift"),
    ParameterMeaning("rotate_inertia", "J2", "kg·m²", "I2 + I3 + I4 + I5 + (m4 + 2 m5) L3² + motor of rotate"),
    ParameterMeaning("stretch_inertia", "J3", "kg·m²", "I3 + I4 + (m4 + 2 m5) L3² + motor of stretch"),
    ParameterMeaning("coupling_inertia", "H", "kg·m²", "I3 - I4 + m4 L3²"),
    ParameterMeaning("forearm_moment", "D", "kg·m²", "m4 x4 L3 + m5 L3²"),
    ParameterMeaning("forearm_moment_across", "D'", "kg·m²", "m4 y4 L3"),
    ParameterMeaning("blade_moment", "E", "kg·m²", "m5 x5 L3"),
    ParameterMeaning("blade_moment_across", "E'", "kg·m²", "m5 y5 L3"),
)
"""Bodies 1 to 5: carriage, hub, upper arm, forearm, blade; m is a body's mass, (x, y) its centre of mass along and across the
link, I its moment of inertia about its own joint."""


@dataclass(frozen=True)
class _Inertia:
    """Entries of M that depend on theta3, and their derivatives by theta3; each (...)."""

    m22: Samples
    m33: Samples
    m23: Samples
    d22: Samples
    d33: Samples
    d23: Samples


def base_parameters(links: LinkParameters, geometry: Geometry) -> BaseParameters:
    """The nine combinations of `links` that the axes feel."""
    upper, fore, blade, arm = links.upper_arm, links.forearm, links.blade, geometry.arm
    lift_motor, rotate_motor, stretch_motor = links.armature
    about_shoulder = upper.about_joint + (fore.mass + blade.mass) * arm**2
    about_elbow = fore.about_joint + blade.mass * arm**2
    return BaseParameters(
        moving_mass=links.carriage + sum(body.mass for body in links.bodies),
        lift_armature=lift_motor,
        rotate_inertia=links.hub.about_joint + about_shoulder + about_elbow + blade.about_joint + rotate_motor,
        stretch_inertia=about_shoulder + about_elbow + stretch_motor,
        coupling_inertia=about_shoulder - about_elbow,
        forearm_moment=(fore.mass * fore.along + blade.mass * arm) * arm,
        forearm_moment_across=fore.mass * fore.across * arm,
        blade_moment=blade.mass * blade.along * arm,
        blade_moment_across=blade.mass * blade.across * arm,
    )


def mass_matrix(base: BaseParameters, joints: Samples) -> Samples:
    """M [kg, kg·m²] at `joints` (..., 3), (..., 3, 3)."""
    at = _inertia(base, joints[..., 2])
    zero = np.zeros_like(at.m22)
    lift = np.full_like(at.m22, base.moving_mass + base.lift_armature)
    return _matrix([[lift, zero, zero], [zero, at.m22, at.m23], [zero, at.m23, at.m33]])


def coriolis(base: BaseParameters, joints: Samples, velocity: Samples) -> Samples:
    """C (..., 3, 3) by Christoffel symbols, so that M' - 2 C is skew-symmetric (Siciliano et al., Robotics, 2009, sec. 7.2)."""
    at = _inertia(base, joints[..., 2])
    rotate, stretch = velocity[..., 1], velocity[..., 2]
    zero = np.zeros_like(at.d22)
    return _matrix(
        [
            [zero, zero, zero],
            [zero, 0.5 * at.d22 * stretch, 0.5 * at.d22 * rotate + at.d23 * stretch],
            [zero, -0.5 * at.d22 * rotate, 0.5 * at.d33 * stretch],
        ]
    )


def gravity(base: BaseParameters) -> Samples:
    """What holds the arm still (3,): the lift carries its weight, the turning axes are vertical."""
    return np.array([base.moving_mass * GRAVITY, 0.0, 0.0])


def torque(base: BaseParameters, joints: Samples, velocity: Samples, acceleration: Samples) -> Samples:
    """Rigid-body torque (..., 3) of a motion, all (..., 3): M q'' + C q' + g."""
    inertial = np.einsum("...ij,...j->...i", mass_matrix(base, joints), acceleration)
    turning = np.einsum("...ij,...j->...i", coriolis(base, joints, velocity), velocity)
    return np.asarray(inertial + turning + gravity(base))


def regressor(joints: Samples, velocity: Samples, acceleration: Samples) -> Samples:
    """Y (..., 3, 9) of a motion, all (..., 3): torque = Y @ BaseParameters.vector(). Of full rank over an exciting motion."""
    stretch, turned, bent = joints[..., 2], velocity[..., 1], velocity[..., 2]
    lifts, turns, bends = np.moveaxis(acceleration, -1, 0)
    zero = np.zeros_like(stretch)
    sine, cosine, sine2, cosine2 = np.sin(stretch), np.cos(stretch), np.sin(2.0 * stretch), np.cos(2.0 * stretch)
    centrifugal = turned**2 + bent**2
    lift = [lifts + GRAVITY, lifts, zero, zero, zero, zero, zero, zero, zero]
    rotate = [
        *(zero, zero, turns, zero, bends),
        -2.0 * cosine2 * turns + 4.0 * sine2 * turned * bent,
        -2.0 * sine2 * turns - 4.0 * cosine2 * turned * bent,
        4.0 * sine * turns + 4.0 * cosine * turned * bent,
        -2.0 * cosine * bends + 2.0 * sine * bent**2,
    ]
    bend = [
        *(zero, zero, zero, bends, turns),
        2.0 * cosine2 * bends - 2.0 * sine2 * centrifugal,
        2.0 * sine2 * bends + 2.0 * cosine2 * centrifugal,
        -2.0 * cosine * turned**2,
        -2.0 * cosine * turns,
    ]
    return _matrix([lift, rotate, bend])


def friction(laws: tuple[FrictionLaw, FrictionLaw, FrictionLaw], velocity: Samples) -> Samples:
    """Friction (..., 3) of lift, rotate, stretch at `velocity` (..., 3): eq. 14, F = Fv q' + Fs sgn(q'), or a richer law."""
    return np.stack([law.torque(velocity[..., axis]) for axis, law in enumerate(laws)], axis=-1)


def lift_torque(base: BaseParameters, acceleration: Samples) -> Samples:
    """The paper's lift equation [N] and the motor's own inertia: (sum m) (d1'' + g) + Jm d1''; exact, whatever the arm does."""
    return np.asarray(base.moving_mass * (acceleration + GRAVITY) + base.lift_armature * acceleration)


def rotation_torque(base: BaseParameters, stretch: Samples, acceleration: Samples) -> Samples:
    """The paper's eq. 7 [N·m], completed: M22(theta3) theta2''; exact while theta3 stands still."""
    return np.asarray(_inertia(base, stretch).m22 * acceleration)


def stretch_torque(base: BaseParameters, stretch: Samples, velocity: Samples, acceleration: Samples) -> Samples:
    """The paper's M(t) t'' + C(t, t') t' with G = 0 [N·m]: M33 theta3'' + M33'/2 theta3'^2; exact while theta2 stands still."""
    at = _inertia(base, stretch)
    return np.asarray(at.m33 * acceleration + 0.5 * at.d33 * velocity**2)


def _inertia(base: BaseParameters, stretch: Samples) -> _Inertia:
    sine, cosine, sine2, cosine2 = np.sin(stretch), np.cos(stretch), np.sin(2.0 * stretch), np.cos(2.0 * stretch)
    folding = 2.0 * (base.forearm_moment * cosine2 + base.forearm_moment_across * sine2)
    unfolding = 4.0 * (base.forearm_moment_across * cosine2 - base.forearm_moment * sine2)
    return _Inertia(
        m22=base.rotate_inertia - folding + 4.0 * base.blade_moment * sine,
        m33=base.stretch_inertia + folding,
        m23=base.coupling_inertia - 2.0 * base.blade_moment_across * cosine,
        d22=-unfolding + 4.0 * base.blade_moment * cosine,
        d33=unfolding,
        d23=2.0 * base.blade_moment_across * sine,
    )


def _matrix(rows: list[list[Samples]]) -> Samples:
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
