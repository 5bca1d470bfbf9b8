"""What would distinguish effects that these data do not: a motion, or a sensor, as each effect says of itself."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from drivetwin.emulator.effects import library


def tell_apart(effect: str, others: Sequence[str]) -> str:
    """The motion that would tell an effect from the others, in words."""
    return _listed(library()[name].by_motion for name in (effect, *others) if name in library()) if others else ""


def sensor_that_tells(effects: Sequence[str], has: Collection[str] = ()) -> str:
    """The sensor that would distinguish effects, in words; empty where none is known but those that the axis `has`."""
    told = (library()[name].by_sensor for name in effects if name in library())
    return _listed(sensor for sensor in told if sensor not in has)


def _listed(words: Iterable[str]) -> str:
    return "; ".join(dict.fromkeys(each for each in words if each))
