"""When a fault strikes: at a time, when the machine moves, after homing, in a state, or after a number of SYNCs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from drivetwin.emulator.drive.state_machine import State
from drivetwin.foundation.errors import UserError

STATES = {state.name.lower(): state for state in State}
"""operation_enabled, fault, ..."""

ALL = "all"


class Glance(Protocol):
    """What a condition can see of the machine, now."""

    time: float
    syncs: int

    def speed(self, axis: str) -> float:
        """True speed of an axis, a magnitude [m/s or rad/s]."""

    def state(self, axis: str) -> State:
        """State of the axis's drive."""

    def homed(self, axis: str) -> bool:
        """Whether the axis has homed since power on."""


@dataclass(frozen=True)
class Condition:
    """All that is given must hold at once. Units: s, m/s or rad/s. An axis may be `all` for `homed` and `state`."""

    axes: tuple[str, ...]
    time: float | None = None
    sync: int | None = None
    moving: str | None = None
    speed: float = 0.0
    homed: str | None = None
    state: State | None = None
    of: str = ALL

    def holds(self, now: Glance) -> bool:
        """Whether it does."""
        return (
            (self.time is None or now.time >= self.time)
            and (self.sync is None or now.syncs >= self.sync)
            and (self.moving is None or now.speed(self.moving) > self.speed)
            and (self.homed is None or all(now.homed(axis) for axis in self._named(self.homed)))
            and (self.state is None or all(now.state(axis) is self.state for axis in self._named(self.of)))
        )

    def _named(self, axis: str) -> tuple[str, ...]:
        return self.axes if axis == ALL else (axis,)


_KEYS = ("time", "sync", "moving", "speed", "homed", "state", "axis", "node")


def read_condition(given: object, nodes: dict[str, int]) -> Condition:
    """A condition of a mapping `{homed: all, moving: rotate, speed: 0.3}`; `nodes` are the node-IDs by axis.

    Raises UserError naming the key for what is unknown or wrong.
    """
    if not isinstance(given, dict) or not given:
        raise UserError(f"when: expected a mapping like {{time: 1.0}} of {', '.join(_KEYS)}, not {given!r}")
    if unknown := [key for key in given if key not in _KEYS]:
        raise UserError(f"when: {unknown[0]!r} is not a condition; there are {', '.join(_KEYS)}")
    _refuse_what_would_be_ignored(given, nodes)
    named = "axis" if "axis" in given else "node"
    return Condition(
        axes=tuple(nodes),
        time=_number("time", given.get("time")),
        sync=_whole("sync", given.get("sync")),
        moving=_axis("moving", given.get("moving"), nodes),
        speed=_number("speed", given.get("speed")) or 0.0,
        homed=_axis_or_all("homed", given.get("homed"), nodes),
        state=_state(given.get("state")),
        of=_axis_or_all(named, given.get(named), nodes) or ALL,
    )


def _refuse_what_would_be_ignored(given: dict[str, object], nodes: dict[str, int]) -> None:
    """A key without a value, or without the one that it belongs to: a condition without content holds at once."""
    if nothing := [key for key, value in given.items() if value is None]:
        raise UserError(f"when: {nothing[0]}: says nothing; give it a value, or leave it out")
    if "speed" in given and "moving" not in given:
        raise UserError(f"when: speed: belongs to moving; add for example moving: {next(iter(nodes))}")
    named = [key for key in ("axis", "node") if key in given]
    if named and "state" not in given:
        raise UserError(f"when: {named[0]}: belongs to state; add for example state: operation_enabled")
    if len(named) > 1:
        raise UserError("when: axis and node both name a drive; leave one out")


def _number(key: str, value: object) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or value < 0:
        raise UserError(f"when: {key}: expected a number from 0 on, not {value!r}")
    return float(value)


def _whole(key: str, value: object) -> int | None:
    number = _number(key, value)
    return None if number is None else int(number)


def _axis(key: str, value: object, nodes: dict[str, int]) -> str | None:
    if value is None:
        return None
    if isinstance(value, str) and value in nodes:
        return value
    by_node = {node: axis for axis, node in nodes.items()}
    if isinstance(value, int) and not isinstance(value, bool) and value in by_node:
        return by_node[value]
    choice = ", ".join(f"{axis} (node {node})" for axis, node in nodes.items())
    raise UserError(f"when: {key}: {value!r} is not an axis of this machine; it has {choice}")


def _axis_or_all(key: str, value: object, nodes: dict[str, int]) -> str | None:
    return ALL if value == ALL else _axis(key, value, nodes)


def _state(value: object) -> State | None:
    if value is None:
        return None
    if not isinstance(value, str) or value not in STATES:
        raise UserError(f"when: state: {value!r} is not a state of a drive; there are {', '.join(STATES)}")
    return STATES[value]
