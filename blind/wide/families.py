"""The kinds of machine that are drawn, from one axis to seven; models of real robots are drawn by `robots`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from drivetwin.blind.wide.machines import AxisLimits, Draw, Link, Machine, equipped, hinge_limits, slide_limits

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
Sketch = tuple[list[Link], list[AxisLimits]]


def draw_family(draw: Draw, family: str) -> Machine:
    """A machine of a family of `FAMILIES`."""
    links, limits = FAMILIES[family](draw)
    return equipped(draw, family, links, limits)


def _log(draw: Draw, low: float, high: float) -> float:
    return float(np.exp(draw.uniform(np.log(low), np.log(high))))


def _block(mass: float, size: float) -> tuple[float, float, float]:
    """Inertia of a cube."""
    return (mass * size**2 / 6.0,) * 3


def _rod(mass: float, length: float, along: int) -> tuple[float, ...]:
    """Inertia of a thick rod along axis `along`."""
    across, own = mass * length**2 / 12.0 + mass * 0.002, mass * 0.004
    return tuple(own if k == along else across for k in range(3))


def _carriage(draw: Draw, name: str, parent: int, axis: tuple[float, float, float], mass: float) -> tuple[Link, AxisLimits]:
    half = _log(draw, 0.08, 0.8) / 2.0
    link = Link(name, parent, (0.0, 0.0, 1.0 if parent < 0 else 0.1), axis, True, mass, (0.0, 0.0, 0.0), _block(mass, 0.2))
    return link, slide_limits(draw, -half, half)


def _rotary(draw: Draw) -> Sketch:
    mass, endless = _log(draw, 0.5, 40.0), bool(draw.random() < 0.4)
    table = Link("table", -1, (0.0, 0.0, 0.5), Z, False, mass, (0.0, 0.0, 0.05), _block(mass, 0.3))
    half = draw.uniform(1.0, 3.0)
    return [table], [hinge_limits(draw, -half, half, endless=endless)]


def _pendulum(draw: Draw) -> Sketch:
    mass, length = _log(draw, 0.5, 20.0), draw.uniform(0.1, 0.6)
    arm = Link("arm", -1, (0.0, 0.0, 1.0), Y, False, mass, (0.0, 0.0, -length), _rod(mass, length, 2))
    middle, half = draw.uniform(-1.5, 1.5), draw.uniform(0.6, 1.8)
    return [arm], [hinge_limits(draw, middle - half, middle + half)]


def _linear(draw: Draw) -> Sketch:
    link, limit = _carriage(draw, "slide", -1, X, _log(draw, 1.0, 150.0))
    return [link], [limit]


def _lift(draw: Draw) -> Sketch:
    link, limit = _carriage(draw, "lift", -1, Z, _log(draw, 1.0, 60.0))
    return [link], [limit]


def _gantry(draw: Draw) -> Sketch:
    first, second = _log(draw, 5.0, 80.0), _log(draw, 1.0, 20.0)
    bridge, bridge_limit = _carriage(draw, "x", -1, X, first)
    head, head_limit = _carriage(draw, "y", 0, Y if draw.random() < 0.5 else Z, second)
    return [bridge, head], [bridge_limit, head_limit]


def _planar(draw: Draw, joints: int) -> Sketch:
    """Arms in a vertical plane."""
    links, limits, length = [], [], 0.0
    for k in range(joints):
        mass = _log(draw, 1.0, 12.0) * 0.7**k
        place = (0.0, 0.0, 1.0) if k == 0 else (length, 0.0, 0.0)
        length = draw.uniform(0.2, 0.5)
        links.append(Link(f"j{k + 1}", k - 1, place, Y, False, mass, (length / 2.0, 0.0, 0.0), _rod(mass, length, 0)))
        middle, half = draw.uniform(-1.0, 1.0), draw.uniform(0.5, 1.5)
        limits.append(hinge_limits(draw, middle - half, middle + half))
    return links, limits


def _scara(draw: Draw) -> Sketch:
    upper, fore = draw.uniform(0.2, 0.45), draw.uniform(0.15, 0.4)
    masses = (_log(draw, 3.0, 12.0), _log(draw, 2.0, 8.0), _log(draw, 0.5, 3.0), _log(draw, 0.2, 1.5))
    links = [
        Link("shoulder", -1, (0.0, 0.0, 0.5), Z, False, masses[0], (upper / 2.0, 0.0, 0.0), _rod(masses[0], upper, 0)),
        Link("elbow", 0, (upper, 0.0, 0.0), Z, False, masses[1], (fore / 2.0, 0.0, 0.0), _rod(masses[1], fore, 0)),
        Link("quill", 1, (fore, 0.0, 0.0), Z, True, masses[2], (0.0, 0.0, 0.0), _block(masses[2], 0.08)),
        Link("wrist", 2, (0.0, 0.0, -0.1), Z, False, masses[3], (0.01, 0.0, 0.0), _block(masses[3], 0.1)),
    ]
    limits = [hinge_limits(draw, -1.5, 1.5), hinge_limits(draw, -2.0, 2.0), slide_limits(draw, -0.08, 0.08)]
    return links, [*limits, hinge_limits(draw, -3.0, 3.0)]


def _serial(draw: Draw, directions: tuple[tuple[float, float, float], ...]) -> Sketch:
    """A robot arm: links that grow lighter towards the hand, masses off the joints' axes."""
    links, limits, total = [], [], _log(draw, 12.0, 90.0)
    shares = np.array([0.26, 0.26, 0.2, 0.12, 0.08, 0.05, 0.03])[: len(directions)]
    lengths = draw.uniform(0.6, 1.2) * np.array([0.35, 0.4, 0.2, 0.2, 0.1, 0.08, 0.05])
    for k, axis in enumerate(directions):
        mass, length = float(total * shares[k] * draw.uniform(0.7, 1.3)), float(lengths[k])
        com = (float(draw.uniform(-0.1, 0.1) * length), float(draw.uniform(-0.1, 0.1) * length), 0.45 * length)
        place = (0.0, 0.0, 0.1) if k == 0 else (0.0, 0.0, float(lengths[k - 1]))
        links.append(Link(f"joint{k + 1}", k - 1, place, axis, False, mass, com, _rod(mass, length, 2)))
        middle = draw.uniform(-0.6, 0.6)
        half = draw.uniform(0.5, 1.4) if axis != Z else draw.uniform(0.8, 2.4)
        limits.append(hinge_limits(draw, middle - half, middle + half))
    return links, limits


FAMILIES: dict[str, Callable[[Draw], Sketch]] = {
    "rotary": _rotary,
    "pendulum": _pendulum,
    "linear": _linear,
    "lift": _lift,
    "gantry": _gantry,
    "arm2": lambda draw: _planar(draw, 2),
    "arm3": lambda draw: _planar(draw, 3),
    "scara": _scara,
    "arm6": lambda draw: _serial(draw, (Z, Y, Y, Z, Y, Z)),
    "arm7": lambda draw: _serial(draw, (Z, Y, Z, Y, Z, Y, Z)),
}
"""By name: single axes, a gantry, arms in a vertical plane, a SCARA, robot arms."""
