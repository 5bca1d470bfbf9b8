"""What the library does not have: by the axis's state in the simulator, by time alone as series drawn here."""

from __future__ import annotations

from collections.abc import Callable
from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from drivetwin.blind.case import Cause
from drivetwin.blind.wide.effects import FOREIGN_PREFIX, Ground, Sizable, Values
from drivetwin.blind.wide.machines import Draw
from drivetwin.blind.wide.simulator import TICK, Outside, quiet

Array = NDArray[np.float64]


def _fan(g: Ground) -> Sizable:
    frequency, phase = g.draw.uniform(1.0, 9.0), g.phase()
    return lambda s: {"amplitude": g.torque * s, "frequency": frequency, "phase": phase}


def _wind(g: Ground) -> Sizable:
    time = g.log(0.05, 0.6)
    return lambda s: {"torque": g.torque * s, "time_constant": time}


def _pulses(g: Ground) -> Sizable:
    pause, length = g.draw.uniform(0.4, 1.5), g.draw.uniform(0.05, 0.15)
    return lambda s: {"height": 4.0 * g.torque * s, "pause": pause, "length": length}


def _chatter(g: Ground) -> Sizable:
    time = g.log(0.03, 0.3)
    return lambda s: {"size": min(s, 0.9), "time_constant": time}


def _jamming(g: Ground) -> Sizable:
    spell = g.draw.uniform(0.5, 2.0)
    return lambda s: {"factor": 1.0 + min(2.0 * s, 3.0), "spell": spell}


def _dropouts(g: Ground) -> Sizable:
    pause, length = g.draw.uniform(0.2, 0.6), g.draw.uniform(0.03, 0.1)
    return lambda s: {"gain": 1.0 - min(2.0 * s, 0.6), "pause": pause, "length": length}


def _counterbalance(g: Ground) -> Sizable:
    time = g.draw.uniform(0.3, 1.5)
    return lambda s: {"stiffness": 4.0 * g.torque * s / g.travel, "time_constant": time}


def _slosh(g: Ground) -> Sizable:
    frequency, ratio = g.draw.uniform(1.0, 4.0), g.draw.uniform(0.02, 0.1)
    inertia = g.links + g.machine.nominal[g.axis].rotor
    return lambda s: {"inertia": inertia * s, "frequency": frequency, "damping_ratio": ratio}


def _tether(g: Ground) -> Sizable:
    short, long = g.draw.uniform(0.05, 0.12) * g.travel, g.draw.uniform(0.2, 0.4) * g.travel
    return lambda s: {"short": short, "long": long, "torque": g.torque * s}


def _wandering_cogging(g: Ground) -> Sizable:
    period, time = g.travel / g.draw.uniform(6.0, 25.0), g.log(0.7, 3.0)
    return lambda s: {"amplitude": g.torque * s, "period": period, "time_constant": time}


def _eddy_brake(g: Ground) -> Sizable:
    speed = g.draw.uniform(0.05, 0.4) * g.speed
    return lambda s: {"torque": g.torque * s, "speed": speed}


def _soft_stop(g: Ground) -> Sizable:
    position = g.middle + g.travel * g.draw.uniform(0.0, 0.3)
    return lambda s: {"position": position, "stiffness": 4.0 * g.torque / g.travel * s}


FOREIGN: dict[str, Callable[[Ground], Sizable]] = {
    FOREIGN_PREFIX + name: draw
    for name, draw in {
        "chatter": _chatter,
        "counterbalance": _counterbalance,
        "dropouts": _dropouts,
        "eddy_brake": _eddy_brake,
        "fan": _fan,
        "jamming": _jamming,
        "pulses": _pulses,
        "slosh": _slosh,
        "soft_stop": _soft_stop,
        "tether": _tether,
        "wandering_cogging": _wandering_cogging,
        "wind": _wind,
    }.items()
}
"""By name, prefix included."""


def outside(items: tuple[tuple[int, Cause], ...], count: int, axes: int, draw: Draw) -> Outside:
    """Series (count, axes) of what acts by time alone; the same draw gives the same series, whatever else acts."""
    series = quiet(count, axes)
    for axis, item in items:
        name, values = item.effect.removeprefix(FOREIGN_PREFIX), item.parameters
        time = np.arange(count) * TICK
        if name == "fan":
            series.pull[:, axis] += values["amplitude"] * np.sin(2.0 * pi * values["frequency"] * time + values["phase"])
        elif name == "wind":
            series.pull[:, axis] += values["torque"] * _coloured(draw, count, values["time_constant"])
        elif name == "pulses":
            series.pull[:, axis] += _pulse_train(draw, count, values)
        elif name == "wandering_cogging":
            steps = draw.standard_normal(count) * sqrt(TICK / values["time_constant"])
            series.pull[:, axis] += 2.0 * pi * np.cumsum(steps)
        elif name == "chatter":
            series.friction[:, axis] = np.maximum(0.1, 1.0 + values["size"] * _coloured(draw, count, values["time_constant"]))
        elif name == "jamming":
            series.friction[:, axis] = np.where(_spells(draw, count, values["spell"], values["spell"]), values["factor"], 1.0)
        elif name == "dropouts":
            series.gain[:, axis] = np.where(_spells(draw, count, values["pause"], values["length"]), values["gain"], 1.0)
    return series


def _coloured(draw: Draw, count: int, time_constant: float) -> Array:
    """A Gauss-Markov process of unit variance."""
    kept = float(np.exp(-TICK / time_constant))
    start = [kept * draw.standard_normal()]
    return np.asarray(signal.lfilter([sqrt(1.0 - kept**2)], [1.0, -kept], draw.standard_normal(count), zi=start)[0])


def _spells(draw: Draw, count: int, pause: float, length: float) -> NDArray[np.bool_]:
    """Where a spell is on that lasts about `length` after about `pause` [s]."""
    on, at = np.zeros(count, dtype=np.bool_), 0
    while at < count:
        at += int(pause * draw.uniform(0.4, 1.6) / TICK)
        end = at + int(length * draw.uniform(0.4, 1.6) / TICK)
        on[at:end] = True
        at = end
    return on


def _pulse_train(draw: Draw, count: int, values: Values) -> Array:
    """Half sines of either sign after random pauses."""
    pull, at = np.zeros(count), 0
    while at < count:
        at += int(draw.exponential(values["pause"]) / TICK)
        length = int(values["length"] * draw.uniform(0.7, 1.4) / TICK)
        height = values["height"] * draw.choice((-1.0, 1.0)) * draw.uniform(0.6, 1.2)
        end = min(at + length, count)
        if at < count:
            pull[at:end] += height * np.sin(pi * np.arange(end - at) / length)
        at += length
    return pull
