"""How large each effect of the library is drawn: so that it matters on the machine and the motion that it is drawn for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi, sqrt

import mujoco
import numpy as np
from numpy.typing import NDArray

from blind.case import FOREIGN, Cause
from blind.foreign import FOREIGN_EFFECTS, Scale
from blind.levels import Levels, extra_torque
from blind.machines import DrawnAxis, DrawnMachine
from emulator.dynamics import AxisDynamics
from emulator.effects import library
from emulator.effects.base import Effect

Draw = np.random.Generator

SHARE = (0.09, 0.25)
"""Torque of an effect as a share of the axis's, both rms while it moves."""

FOREIGN_SHARE = (0.12, 0.28)
"""The same of effects outside the library, of which one of the library may explain a part."""

SEEN = 40.0
"""What swings faster [Hz] is hardly in the band in which torques are compared."""


@dataclass(frozen=True)
class Ground:
    """What an effect is drawn for."""

    draw: Draw
    machine: DrawnMachine
    name: str
    all_levels: dict[str, Levels]

    @property
    def axis(self) -> DrawnAxis:
        """The axis."""
        return self.machine.axes[self.name]

    @property
    def levels(self) -> Levels:
        """Its motion and torque."""
        return self.all_levels[self.name]

    def share(self) -> float:
        """How much the effect is to cost."""
        return float(self.draw.uniform(*SHARE))

    def sign(self) -> float:
        """Plus or minus 1."""
        return float(self.draw.choice((-1.0, 1.0)))

    def phase(self) -> float:
        """Any [rad]."""
        return float(self.draw.uniform(-pi, pi))

    def size(self, regressor: NDArray[np.float64]) -> float:
        """Factor at which `regressor` (n,) costs its share."""
        return self.levels.size(self.share(), regressor)

    def changed(self, value: float, regressor: NDArray[np.float64], floor: float = 0.3) -> float:
        """A parameter of the model changed either way by what costs its share, and at least to `floor` times itself."""
        change = self.size(regressor)
        return value - change if self.draw.random() < 0.5 and change < (1.0 - floor) * value else value + change

    @property
    def links(self) -> float:
        """Inertia of what the transmission moves [kg·m² or kg]."""
        return self.axis.inertia - self.rotor

    @property
    def rotor(self) -> float:
        """Inertia of the rotor at the joint."""
        return self.axis.rotor_inertia * self.axis.gear_ratio**2

    def spring(self, frequency: float, damping_ratio: float) -> dict[str, float]:
        """Stiffness and damping between rotor and links that swing at `frequency` [Hz]."""
        between = self.rotor * self.links / self.axis.inertia
        stiffness = between * (2.0 * pi * frequency) ** 2
        return {"stiffness": stiffness, "damping": 2.0 * damping_ratio * sqrt(stiffness * between)}

    def wave(self, order: float) -> NDArray[np.float64]:
        """Angular frequency (n,) [rad/s] of what comes `order` times a motor turn; 0 where it is too fast to be seen."""
        frequency = order * self.axis.gear_ratio * np.abs(self.levels.velocity)
        return np.where(frequency < 2.0 * pi * SEEN, frequency, 0.0)


Values = dict[str, float]


def _coulomb(g: Ground) -> Values:
    return {"coulomb": g.changed(g.axis.coulomb, np.sign(g.levels.velocity))}


def _viscous(g: Ground) -> Values:
    return {"viscous": g.changed(g.axis.viscous, g.levels.velocity)}


def _coulomb_asymmetry(g: Ground) -> Values:
    return {"asymmetry": g.sign() * min(g.size(np.ones_like(g.levels.velocity)), 0.8 * g.axis.coulomb)}


def _viscous_asymmetry(g: Ground) -> Values:
    return {"asymmetry": g.sign() * min(g.size(g.levels.velocity), 0.85 * g.axis.viscous)}


def _stribeck(g: Ground) -> Values:
    speed = g.draw.uniform(0.015, 0.06) * g.axis.max_speed
    more = g.size(np.exp(-((g.levels.velocity / speed) ** 2)))
    static = g.axis.coulomb + float(np.clip(more, 0.3 * g.axis.coulomb, 1.8 * g.axis.coulomb))
    return {"static_torque": static, "stribeck_velocity": speed, "exponent": float(g.draw.choice((1.0, 2.0)))}


def _viscous_nonlinear(g: Ground) -> Values:
    speed = g.levels.velocity
    if g.draw.random() < 0.5:
        return {"quadratic": g.size(np.abs(speed) * speed)}
    return {"quadratic": 0.0, "cubic": g.size(speed**3)}


def _presliding(g: Ground) -> Values:
    way = g.draw.uniform(0.002, 0.008) * g.axis.room
    stiffness = 1.6 * g.axis.coulomb / way
    return {"stiffness": stiffness, "damping": 2.0 * g.draw.uniform(0.05, 0.2) * sqrt(stiffness * g.axis.inertia)}


def _load_friction(g: Ground) -> Values:
    return {"coefficient": g.share()}


def _position_friction(g: Ground) -> Values:
    amplitude = min(sqrt(2.0) * g.size(np.ones_like(g.levels.velocity)), 0.9 * g.axis.coulomb)
    return {"amplitude": amplitude, "period": g.axis.room / g.draw.uniform(2.5, 8.0), "phase": g.phase()}


def _temperature_drift(g: Ground) -> Values:
    return {"cold": g.draw.uniform(0.5, 1.0), "time_constant": g.draw.uniform(20.0, 50.0)}


def _inertia(g: Ground) -> Values:
    return {"difference": g.changed(g.rotor, g.levels.acceleration, floor=0.2) - g.rotor}


def _payload(g: Ground) -> Values:
    spec = mujoco.MjSpec.from_string(g.machine.model)
    body = spec.joint(g.name).parent
    place = np.zeros(3) if g.axis.slide else np.array(body.geoms[0].pos) * g.draw.uniform(1.2, 2.2)
    at = dict(zip("xyz", (float(value) for value in place), strict=True))
    return {"mass": g.size(_costs(g, "payload", {"mass": 1.0, **at})), **at}


def _gravity(g: Ground) -> Values:
    if g.axis.slide:
        return {"moment": g.sign() * g.size(np.ones_like(g.levels.velocity))}
    angle = g.phase()
    return {"moment": g.size(np.sin(g.levels.position - angle)), "angle": angle}


def _spring(g: Ground) -> Values:
    rest = g.axis.middle + g.draw.uniform(-0.3, 0.3) * g.axis.room
    return {"stiffness": g.size(g.levels.position - rest), "rest": rest}


def _coupling(g: Ground) -> Values:
    ratio = g.sign() * g.draw.uniform(0.5, 1.5)
    return {"inertia": g.size(_costs(g, "coupling", {"inertia": 1e-3, "ratio": ratio})) * 1e-3, "ratio": ratio}


def _costs(g: Ground, effect: str, parameters: Values) -> NDArray[np.float64]:
    """Torque (n,) on the axis of an effect that changes the rigid bodies."""
    spec = mujoco.MjSpec.from_string(g.machine.model)
    made: Effect = library()[effect](**parameters)
    made.add_to(spec, spec.joint(g.name), AxisDynamics())
    return extra_torque(g.machine, spec.compile(), g.all_levels)[g.name]


def _backlash(g: Ground) -> Values:
    gap = g.draw.uniform(0.00008, 0.0003) * g.axis.room
    return {"gap": gap, **g.spring(g.draw.uniform(40.0, 70.0), g.draw.uniform(0.1, 0.3))}


def _elasticity(g: Ground) -> Values:
    return g.spring(g.draw.uniform(12.0, 24.0), g.draw.uniform(0.02, 0.06))


def _transmission_error(g: Ground) -> Values:
    order = float(g.draw.choice((1.0, 2.0)))
    amplitude = sqrt(2.0) * g.size(g.links * g.wave(order) ** 2)
    return {"amplitude": min(amplitude, 0.3 / (order * g.axis.gear_ratio)), "order": order, "phase": g.phase()}


def _torque_constant(g: Ground) -> Values:
    return {"error": g.sign() * g.share()}


def _torque_saturation(g: Ground) -> Values:
    asked = np.abs(g.levels.torque)
    steady = float(asked[np.abs(g.levels.acceleration) < 0.05 * g.axis.max_acceleration].max())
    return {"limit": steady + g.draw.uniform(0.72, 0.88) * (float(asked.max()) - steady)}


def _torque_ripple(g: Ground) -> Values:
    order = float(g.draw.choice((1.0, 2.0, 3.0, 4.0, 6.0)))
    amplitude = sqrt(2.0) * g.size(np.where(g.wave(order) > 0.0, 1.0, 0.0))
    return {"amplitude": min(amplitude, 0.5 * g.levels.torque_rms), "order": order, "phase": g.phase()}


def _torque_offset(g: Ground) -> Values:
    return {"offset": g.sign() * g.size(np.ones_like(g.levels.velocity))}


def _current_bandwidth(g: Ground) -> Values:
    return {"bandwidth": g.draw.uniform(0.65, 0.9) * g.axis.bandwidth / (2.0 * pi)}


def _encoder_eccentricity(g: Ground) -> Values:
    wave = g.wave(1.0)
    followed = 1.0 / np.sqrt(1.0 + (wave / g.axis.bandwidth) ** 2)
    return {"amplitude": sqrt(2.0) * g.size(g.axis.inertia * wave**2 * followed), "phase": g.phase()}


def _delay(g: Ground) -> Values:
    return {"delay": g.draw.uniform(0.45, 0.65) / g.axis.bandwidth}


SIZES: dict[str, Callable[[Ground], Values]] = {
    "coulomb": _coulomb,
    "viscous": _viscous,
    "coulomb_asymmetry": _coulomb_asymmetry,
    "viscous_asymmetry": _viscous_asymmetry,
    "stribeck": _stribeck,
    "viscous_nonlinear": _viscous_nonlinear,
    "presliding": _presliding,
    "load_friction": _load_friction,
    "position_friction": _position_friction,
    "temperature_drift": _temperature_drift,
    "inertia": _inertia,
    "payload": _payload,
    "gravity": _gravity,
    "spring": _spring,
    "coupling": _coupling,
    "backlash": _backlash,
    "elasticity": _elasticity,
    "transmission_error": _transmission_error,
    "torque_constant": _torque_constant,
    "torque_saturation": _torque_saturation,
    "torque_ripple": _torque_ripple,
    "torque_offset": _torque_offset,
    "current_bandwidth": _current_bandwidth,
    "encoder_eccentricity": _encoder_eccentricity,
    "delay": _delay,
}
"""Every effect that is drawn, and how."""

FAMILY = {name: library()[name].family for name in SIZES}

_ALIKE = (
    {"gravity", "torque_offset", "coulomb_asymmetry", "viscous_asymmetry", "payload", "spring"},
    {"inertia", "payload", "coupling", "torque_constant"},
    {"coulomb", "load_friction", "temperature_drift", "stribeck", "presliding", "torque_constant", "position_friction"},
    {"viscous", "viscous_nonlinear", "viscous_asymmetry"},
    {"delay", "current_bandwidth", "torque_saturation"},
    {"backlash", "elasticity", "presliding"},
    {"transmission_error", "torque_ripple", "encoder_eccentricity", "position_friction"},
)

KIN = {name: frozenset(number for number, alike in enumerate(_ALIKE) if name in alike) for name in SIZES}
"""Groups of effects of which one could be mistaken for part of another: no pair is drawn from one group."""

ALONE = frozenset({"torque_saturation"})
"""Effects that no pair has: a machine whose torque ends below what another effect costs stops."""

RINGING = frozenset({"elasticity", "delay"})
"""Effects that no axis has both of: a spring and a dead time make the loops oscillate, and the drive trips before homing."""


def suits(effect: str, machine: DrawnMachine, axis: str) -> bool:
    """Whether an effect makes sense on an axis and is not another one there: a payload of a slide or a disc is inertia."""
    names = list(machine.axes)
    if effect == "payload":
        return axis == names[-1] and machine.family not in ("turntable", "stage")
    if effect == "coupling":
        return names.index(axis) > 0 and not machine.axes[names[names.index(axis) - 1]].slide
    if effect == "gravity":
        return machine.family != "scara3" or machine.axes[axis].slide
    return True


def draw_cause(draw: Draw, effect: str, axis: str, machine: DrawnMachine, levels: dict[str, Levels]) -> Cause:
    """An effect on an axis, of a size that matters on this motion."""
    values = SIZES[effect](Ground(draw, machine, axis, levels))
    return Cause(effect, axis, {name: float(value) for name, value in values.items()})


def draw_foreign(draw: Draw, effect: str, axis: str, machine: DrawnMachine, levels: dict[str, Levels]) -> Cause:
    """An effect outside the library on an axis, of a size that matters on this motion."""
    level, share = levels[axis], float(draw.uniform(*FOREIGN_SHARE))
    scale = Scale(
        torque=share * level.torque_rms,
        axis_torque=level.torque_rms,
        friction=machine.axes[axis].coulomb,
        room=machine.axes[axis].room,
        acceleration=level.rms(level.acceleration),
    )
    values = FOREIGN_EFFECTS[effect.removeprefix(FOREIGN)].drawn(draw, scale)
    return Cause(effect, axis, {name: float(value) for name, value in values.items()})
