"""Every effect of the library as it is drawn here and put into equations of its own, by the table of docs/effects.md."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from drivetwin.blind.case import Cause
from drivetwin.blind.wide.friction import yielding_way
from drivetwin.blind.wide.machines import Draw, Machine
from drivetwin.blind.wide.truth import COUNTERBALANCE, EDDY_BRAKE, MAXWELL, SLOSH, SOFT_STOP, TETHER, WANDERING_COGGING, Axes

Values = dict[str, float]
Sizable = Callable[[float], Values]
"""Parameters by a factor of the effect's size; 1 is a usual one."""

FOREIGN_PREFIX = "foreign:"

CHANNEL = frozenset({"torque_lag", "torque_lowpass", "out_of_step"})
"""Nuisances of the recording's torque channel alone, which act on nothing that moves."""

SENSING = frozenset({"encoder_eccentricity", "delay"})
MOST_PLAY = 0.01
"""Of the travel, that play is at most: a load that rests on one flank would be given any, to be felt at all."""
DRIVE = frozenset({"torque_saturation", "current_bandwidth"})
"""What tells in the torque that a drive asks for, not in what a motion needs."""


@dataclass(frozen=True)
class Ground:
    """What an effect is drawn for: an axis, rms and top of its torque [N·m or N], inertia of its links, its motion."""

    draw: Draw
    machine: Machine
    axis: int
    torque: float
    top_torque: float
    links: float
    travel: float
    middle: float
    speed: float
    parent: int

    def sign(self) -> float:
        """Plus or minus 1."""
        return float(self.draw.choice((-1.0, 1.0)))

    def phase(self) -> float:
        """Any [rad]."""
        return float(self.draw.uniform(-pi, pi))

    def log(self, low: float, high: float) -> float:
        """Between `low` and `high`, every octave as likely."""
        return float(np.exp(self.draw.uniform(np.log(low), np.log(high))))

    def spring(self, frequency: float, ratio: float) -> tuple[float, float]:
        """Stiffness and damping at which rotor and links swing at `frequency` [Hz], `ratio` of critical damping."""
        rotor = self.machine.nominal[self.axis].rotor
        between = rotor * self.links / (rotor + self.links)
        stiffness = between * (2.0 * pi * frequency) ** 2
        return stiffness, 2.0 * ratio * sqrt(stiffness * between)


def _stribeck(g: Ground) -> Sizable:
    known, falls, exponent = g.machine.nominal[g.axis], g.log(0.004, 0.08) * g.speed, float(g.draw.uniform(0.5, 2.5))
    return lambda s: {
        "static_torque": known.coulomb + min(g.torque * s, 2.5 * known.coulomb),
        "stribeck_velocity": falls,
        "exponent": exponent,
    }


def _coulomb_asymmetry(g: Ground) -> Sizable:
    sign, most = g.sign(), 0.9 * g.machine.nominal[g.axis].coulomb
    return lambda s: {"asymmetry": sign * min(g.torque * s, most)}


def _viscous_asymmetry(g: Ground) -> Sizable:
    sign, most = g.sign(), 0.9 * g.machine.nominal[g.axis].viscous
    return lambda s: {"asymmetry": sign * min(g.torque / g.speed * s, most)}


def _viscous_nonlinear(g: Ground) -> Sizable:
    if g.draw.random() < 0.6:
        return lambda s: {"quadratic": g.torque / g.speed**2 * s, "cubic": 0.0}
    return lambda s: {"quadratic": 0.0, "cubic": g.torque / g.speed**3 * s}


def _presliding(g: Ground) -> Sizable:
    known = g.machine.nominal[g.axis]
    way = g.log(0.002, 0.02) * g.travel
    ratio = g.log(0.02, 0.3)

    longest = yielding_way(g.machine.links[g.axis].slide)[1]

    def sized(s: float) -> Values:
        stiffness = known.coulomb / min(way * s / 1.6, longest)
        return {"stiffness": stiffness, "damping": 2.0 * ratio * sqrt(stiffness * (g.links + known.rotor))}

    return sized


def _load_friction(_g: Ground) -> Sizable:
    return lambda s: {"coefficient": min(s, 0.6)}


def _position_friction(g: Ground) -> Sizable:
    period, phase, most = g.travel / g.draw.uniform(1.5, 8.0), g.phase(), 0.9 * g.machine.nominal[g.axis].coulomb
    return lambda s: {"amplitude": min(g.torque * s, most), "period": period, "phase": phase}


def _temperature_drift(g: Ground) -> Sizable:
    time = g.log(60.0, 900.0)
    return lambda s: {"cold": min(s, 3.0), "time_constant": time}


def _changed(g: Ground, name: str, value: float, unit: float) -> Sizable:
    sign = g.sign()
    return lambda s: {name: max(value + sign * unit * s, 0.15 * value)}


def _coulomb(g: Ground) -> Sizable:
    return _changed(g, "coulomb", g.machine.nominal[g.axis].coulomb, g.torque)


def _viscous(g: Ground) -> Sizable:
    return _changed(g, "viscous", g.machine.nominal[g.axis].viscous, g.torque / g.speed)


def _inertia(g: Ground) -> Sizable:
    sign, rotor = g.sign(), g.machine.nominal[g.axis].rotor
    return lambda s: {"difference": max(sign * s * (rotor + g.links), -0.8 * rotor)}


def _payload(g: Ground) -> Sizable:
    link = g.machine.links[g.axis]
    place = np.array(link.com) * g.draw.uniform(0.5, 2.0) + g.draw.uniform(-0.05, 0.05, size=3)
    return lambda s: {"mass": link.mass * s, **dict(zip("xyz", map(float, place), strict=True))}


def _gravity(g: Ground) -> Sizable:
    angle = g.phase()
    return lambda s: {"moment": g.torque * s, "angle": angle}


def _spring(g: Ground) -> Sizable:
    rest = g.middle + g.travel * g.draw.uniform(-0.5, 0.5)
    return lambda s: {"stiffness": g.torque / g.travel * s, "rest": rest}


def _coupling(g: Ground) -> Sizable:
    ratio = g.sign() * g.log(0.2, 1.0)
    if g.machine.links[g.axis].slide != g.machine.links[g.parent].slide:
        ratio *= g.machine.limits[g.axis].max_speed / g.machine.limits[g.parent].max_speed
    return lambda s: {"inertia": (g.links + g.machine.nominal[g.axis].rotor) * s, "ratio": ratio}


def _backlash(g: Ground) -> Sizable:
    stiffness, damping = g.spring(g.log(40.0, 150.0), g.log(0.03, 0.3))
    gap, before = g.log(2e-4, 4e-3) * min(g.travel, 1.0), g.draw.uniform()
    flank = {"stiffness": stiffness, "damping": damping, "motor_friction_share": before}
    return lambda s: {"gap": min(gap * s, MOST_PLAY * g.travel), **flank}


def _elasticity(g: Ground) -> Sizable:
    frequency, ratio, before = g.log(10.0, 50.0), g.log(0.01, 0.15), g.draw.uniform()

    def sized(s: float) -> Values:
        stiffness, damping = g.spring(min(max(frequency / sqrt(s), 5.0), 90.0), ratio)
        return {"stiffness": stiffness, "damping": damping, "motor_friction_share": before}

    return sized


def _turn(g: Ground) -> float:
    """Way of the joint in a turn of the motor."""
    return 2.0 * pi / g.machine.limits[g.axis].gear_ratio


def _order(g: Ground) -> float:
    """Waves a motor turn that its usual speed does not make faster than 150 Hz."""
    turn = _turn(g)
    usual = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 12.0, 18.0, 24.0, 36.0, 48.0)
    fit = [order for order in usual if 0.4 * g.speed * order / turn < 150.0 and turn / order < g.travel]
    return float(g.draw.choice(fit)) if fit else 1.0


def _transmission_error(g: Ground) -> Sizable:
    order, phase = min(_order(g), 4.0), g.phase()
    wave = order * g.machine.limits[g.axis].gear_ratio
    return lambda s: {"amplitude": min(0.02 * s, 0.5) / wave, "order": order, "phase": phase}


def _torque_constant(g: Ground) -> Sizable:
    sign = g.sign()
    return lambda s: {"error": max(min(sign * s, 1.0), -0.5)}


def _magnetic_saturation(g: Ground) -> Sizable:
    return lambda s: {"knee": g.torque / max(s, 1e-6) ** 0.5}


def _torque_offset(g: Ground) -> Sizable:
    sign = g.sign()
    return lambda s: {"offset": sign * g.torque * s}


def _torque_ripple(g: Ground) -> Sizable:
    order, phase = _order(g), g.phase()
    return lambda s: {"amplitude": g.torque * s, "order": order, "phase": phase}


def _torque_saturation(g: Ground) -> Sizable:
    return lambda s: {"limit": g.top_torque / (1.0 + s)}


def _current_bandwidth(_g: Ground) -> Sizable:
    return lambda s: {"bandwidth": min(max(40.0 / s, 3.0), 1000.0)}


def _encoder_eccentricity(g: Ground) -> Sizable:
    gear, phase = g.machine.limits[g.axis].gear_ratio, g.phase()
    return lambda s: {"amplitude": min(0.005 * s, 0.3) / gear, "phase": phase}


def _delay(_g: Ground) -> Sizable:
    return lambda s: {"delay": min(0.003 * s, 0.03)}


def _torque_lag(_g: Ground) -> Sizable:
    return lambda s: {"delay": min(0.001 * s, 0.003)}


def _torque_lowpass(_g: Ground) -> Sizable:
    return lambda s: {"bandwidth": max(200.0 / s, 50.0)}


def _out_of_step(g: Ground) -> Sizable:
    sign = g.sign()
    return lambda s: {"delay": sign * min(0.001 * s, 0.003)}


LIBRARY: dict[str, Callable[[Ground], Sizable]] = {
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
    "magnetic_saturation": _magnetic_saturation,
    "torque_saturation": _torque_saturation,
    "torque_ripple": _torque_ripple,
    "torque_offset": _torque_offset,
    "current_bandwidth": _current_bandwidth,
    "encoder_eccentricity": _encoder_eccentricity,
    "delay": _delay,
}
"""Effects of the library (contract gap-report/2) by name."""

NUISANCES: dict[str, Callable[[Ground], Sizable]] = {
    **{
        name: LIBRARY[name]
        for name in (
            *("coulomb_asymmetry", "viscous_asymmetry", "stribeck", "viscous_nonlinear", "load_friction", "position_friction"),
            *("temperature_drift", "torque_constant", "torque_offset", "torque_ripple", "encoder_eccentricity"),
        )
    },
    "torque_lag": _torque_lag,
    "torque_lowpass": _torque_lowpass,
    "out_of_step": _out_of_step,
}
"""What comes beside a cause."""


def suits(effect: str, machine: Machine, axis: int) -> bool:
    """Whether an axis can have an effect: something to couple with, and no weight on a slide, which is a torque offset."""
    if effect == "coupling":
        return machine.links[axis].parent >= 0
    if effect == "gravity":
        return not machine.links[axis].slide
    if effect in ("spring", "position_friction", FOREIGN_PREFIX + "soft_stop", FOREIGN_PREFIX + "counterbalance"):
        return not machine.limits[axis].endless
    return True


# What an effect changes of an axis's record; `payload` and the channel's nuisances are put in elsewhere.
_FIELDS: dict[str, dict[str, str]] = {
    "coulomb": {"coulomb": "coulomb"},
    "viscous": {"viscous": "viscous"},
    "coulomb_asymmetry": {"asymmetry": "asymmetry"},
    "viscous_asymmetry": {"asymmetry": "viscous_asymmetry"},
    "stribeck": {"stribeck_velocity": "stribeck_velocity", "exponent": "exponent"},
    "viscous_nonlinear": {"quadratic": "quadratic", "cubic": "cubic"},
    "presliding": {"stiffness": "stiffness", "damping": "micro_damping"},
    "load_friction": {"coefficient": "load_coefficient"},
    "position_friction": {"amplitude": "wave", "period": "wave_period", "phase": "wave_phase"},
    "temperature_drift": {"cold": "cold", "time_constant": "warming_time"},
    "gravity": {"moment": "moment", "angle": "moment_angle"},
    "spring": {"stiffness": "spring", "rest": "spring_rest"},
    "coupling": {"inertia": "shared_inertia", "ratio": "shared_ratio"},
    "backlash": {"gap": "gap", "stiffness": "flank", "damping": "flank_damping", "motor_friction_share": "motor_friction"},
    "elasticity": {"stiffness": "elasticity", "damping": "elasticity_damping", "motor_friction_share": "motor_friction"},
    "transmission_error": {"amplitude": "error_amplitude", "order": "error_order", "phase": "error_phase"},
    "torque_constant": {"error": "constant_error"},
    "magnetic_saturation": {"knee": "saturates_at"},
    "torque_saturation": {"limit": "torque_limit"},
    "torque_offset": {"offset": "offset"},
    "encoder_eccentricity": {"amplitude": "eccentricity", "phase": "eccentricity_phase"},
    "delay": {"delay": "delay"},
    FOREIGN_PREFIX + "counterbalance": {"stiffness": "foreign_1", "time_constant": "foreign_2"},
    FOREIGN_PREFIX + "slosh": {"inertia": "foreign_1", "frequency": "foreign_2", "damping_ratio": "foreign_3"},
    FOREIGN_PREFIX + "tether": {"short": "foreign_1", "long": "foreign_2", "torque": "foreign_3"},
    FOREIGN_PREFIX + "wandering_cogging": {"amplitude": "foreign_1", "period": "foreign_2"},
    FOREIGN_PREFIX + "eddy_brake": {"torque": "foreign_1", "speed": "foreign_2"},
    FOREIGN_PREFIX + "soft_stop": {"position": "foreign_1", "stiffness": "foreign_2"},
}
_FOREIGN_NUMBER = {
    "counterbalance": COUNTERBALANCE,
    "slosh": SLOSH,
    "tether": TETHER,
    "wandering_cogging": WANDERING_COGGING,
    "eddy_brake": EDDY_BRAKE,
    "soft_stop": SOFT_STOP,
}


def put(axes: Axes, axis: int, parent: int, item: Cause) -> None:
    """Put an effect into the record of its axis."""
    values = item.parameters
    for name, field in _FIELDS.get(item.effect, {}).items():
        if name == "motor_friction_share":
            axes[axis][field] = max(axes[axis][field], values.get(name, 0.0))
        elif name in values:
            axes[axis][field] = values[name]
    match item.effect:
        case "stribeck":
            axes[axis]["static"] = values["static_torque"] - axes[axis]["coulomb"]
        case "presliding":
            axes[axis]["law"] = MAXWELL
        case "inertia":
            axes[axis]["rotor"] += values["difference"]
        case "coupling":
            axes[axis]["shared_with"] = parent
        case "current_bandwidth":
            axes[axis]["current_lag"] = 1.0 / (2.0 * pi * values["bandwidth"])
        case "torque_ripple":
            second = "_2" if axes[axis]["ripple"] > 0.0 else ""
            axes[axis][f"ripple{second}"] = values["amplitude"]
            axes[axis][f"ripple{second}_order"] = values["order"]
            axes[axis][f"ripple{second}_phase"] = values["phase"]
    if item.effect.startswith(FOREIGN_PREFIX):
        axes[axis]["foreign"] = _FOREIGN_NUMBER.get(item.effect.removeprefix(FOREIGN_PREFIX), 0)
