"""A case for any machine: axes by their place, positions, speeds, torques and masses as shares of what the bench allows them.

In a scenario `first`, `middle` and `last` are axes in the order of the machine, and `each` is every one of them. `75 %` is a
share: of the travel where an axis goes, of its greatest speed or torque in a fault, of the limit in an expectation. A machine
of one axis has it in all places.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.expectations.base import LIMIT, Expectation
from drivetwin.hil_tests.task import Task

EACH = "each"
FREE = "free"
"""As a node-ID: one that no axis has."""
PAYLOAD = "payload"
"""As a mass: the bench's limit of that name."""
_SHARE = re.compile(r"^\s*(-?\d+(?:\.\d+)?)\s*%\s*$")
_RPDO = re.compile(r"^rpdo ([1-4])$")


def why_no_payload(faults: list[dict[str, Any]], bench: Bench) -> str | None:
    """Why a case about the machine's payload is not for this bench; None: it is, or is about none."""
    if any(fault.get("mass") == PAYLOAD for fault in faults) and PAYLOAD not in bench.limits:
        return f"the bench does not say what load its machine carries (limits.{PAYLOAD} in {bench.path.name})"
    return None


def task_on(task: Task, bench: Bench) -> Task:
    """The task with names and positions of the bench's machine. Raises UserError for a share of a travel that is not told."""
    told = dict(task.parameters)
    if isinstance(moves := told.get("moves"), list):
        told["moves"] = [one for move in moves for one in _moves(move, bench)]
    if isinstance(poses := told.get("poses"), list):
        told["poses"] = [_pose(pose, bench) for pose in poses]
    return task.model_copy(update={"parameters": told})


def fault_on(given: dict[str, Any], bench: Bench) -> dict[str, Any]:
    """The fault with names and numbers of the bench's machine."""
    told = {key: _axis(value, bench) if key == "node" else value for key, value in given.items()}
    node = bench.virtual.axes.get(str(told.get("node")))
    if node is not None and isinstance(cob_id := told.get("cob_id"), str) and (number := _RPDO.match(cob_id)):
        told["cob_id"] = 0x100 * (1 + int(number[1])) + node.node_id
    if told.get("new_id") == FREE:
        taken = {axis.node_id for axis in bench.virtual.axes.values()}
        told["new_id"] = next(number for number in range(1, 128) if number not in taken)
    if told.get("mass") == PAYLOAD and PAYLOAD in bench.limits:
        told["mass"] = bench.limit(PAYLOAD)
    if (share := _share(told.get("torque"))) is not None:
        told["torque"] = share * _of(bench, "torque", str(told.get("node")))
    if isinstance(when := told.get("when"), dict):
        told["when"] = _condition(when, bench)
    return told


def expectation_on(given: Any, kind: type[Expectation], bench: Bench) -> Any:
    """The expectation with names of the bench's machine, and shares of its limits as numbers."""
    if not isinstance(given, dict):
        return given
    name, told = next(iter(given.items()))
    if not isinstance(told, dict):
        return {name: _named(told, kind.shorthand, bench)}
    limits = {one.name: str(one.metadata[LIMIT]) for one in fields(kind) if LIMIT in one.metadata}
    return {name: {key: _expected(value, key, limits.get(key), bench) for key, value in told.items()}}


def _expected(value: Any, key: str, limit: str | None, bench: Bench) -> Any:
    if limit is not None and isinstance(value, dict):
        return {axis: _of_limit(one, limit, axis, bench) for axis, one in _by_axis(value, bench).items()}
    if limit is not None and _share(value) is not None:
        return {axis: _of_limit(value, limit, axis, bench) for axis in bench.axes}
    if isinstance(value, list):
        return [_axis(one, bench) for one in value]
    return _named(value, key, bench)


def _of_limit(value: Any, limit: str, axis: str, bench: Bench) -> Any:
    share = _share(value)
    return value if share is None else share * _of(bench, limit, axis)


def _named(value: Any, parameter: str | None, bench: Bench) -> Any:
    """`node: middle` is that axis's node-ID."""
    axis = _axis(value, bench)
    return bench.virtual.axes[axis].node_id if parameter == "node" and axis in bench.axes else value


def _moves(move: Any, bench: Bench) -> list[Any]:
    if not isinstance(move, dict) or not {"axis", "to"} <= move.keys():
        return [move]
    axes = bench.axes if move["axis"] == EACH else (_axis(move["axis"], bench),)
    targets = move["to"] if isinstance(move["to"], list) else [move["to"]]
    return [{**move, "axis": axis, "to": _position(to, axis, bench)} for axis in axes for to in targets]


def _pose(pose: Any, bench: Bench) -> Any:
    if not isinstance(pose, dict):
        return pose
    return {axis: _position(to, axis, bench) for axis, to in _by_axis(pose, bench).items()}


def _by_axis(given: Mapping[Any, Any], bench: Bench) -> dict[Any, Any]:
    """By the axes' own names; what is said of one counts more than what is said of each."""
    found = dict.fromkeys(bench.axes, given[EACH]) if EACH in given else {}
    return found | {_axis(axis, bench): value for axis, value in given.items() if axis != EACH}


def _condition(when: dict[str, Any], bench: Bench) -> dict[str, Any]:
    told = {key: _axis(value, bench) if key in ("moving", "homed", "axis", "node") else value for key, value in when.items()}
    if (share := _share(told.get("speed"))) is not None:
        told["speed"] = share * _of(bench, "speed", str(told.get("moving")))
    return told


def _axis(word: Any, bench: Bench) -> Any:
    places = {"first": 0, "middle": len(bench.axes) // 2, "last": -1}
    return bench.axes[places[word]] if isinstance(word, str) and word in places and word not in bench.axes else word


def _position(value: Any, axis: Any, bench: Bench) -> Any:
    if (share := _share(value)) is None:
        return value
    told = bench.real_limits[axis].travel if axis in bench.real_limits else _whole(bench, "travel", axis)
    if not isinstance(told, tuple):
        raise UserError(f"{bench.path}: limits.travel: says no lowest and highest position of {axis}, and {value} is asked")
    return told[0] + share * (told[1] - told[0])


def _of(bench: Bench, limit: str, axis: str) -> float:
    told = _whole(bench, limit, axis)
    if not isinstance(told, float | int):
        raise UserError(f"{bench.path}: limits.{limit}: says nothing of {axis}, and the case asks for a share of it")
    return float(told)


def _whole(bench: Bench, limit: str, axis: str) -> object:
    told = bench.limit(limit)
    return told.get(axis) if isinstance(told, dict) else told


def _share(value: Any) -> float | None:
    found = _SHARE.match(value) if isinstance(value, str) else None
    return None if found is None else float(found[1]) / 100.0
