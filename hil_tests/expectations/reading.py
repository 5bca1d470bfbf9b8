"""An expectation of a scenario, its limits taken from the bench."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, fields
from typing import Any

from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.bench import Bench
from drivetwin.hil_tests.expectations.base import LIMIT, Expectation
from drivetwin.hil_tests.expectations.library import library


def read_expectation(given: object, bench: Bench) -> Expectation:
    """The expectation of `heartbeat`, `{outcome: stopped}` or `{stopped: {within: stop_time}}`.

    A number may be the name of a limit of the bench. Raises UserError naming what is unknown, missing or wrong.
    """
    kind, (name, told) = expectation_kind(given), _parts(given)
    known = {one.name: one for one in fields(kind)}
    parameters = _parameters(kind, told)
    if unknown := [key for key in parameters if key not in known]:
        raise UserError(f"expect: {name} has no {unknown[0]!r}; it has {', '.join(known) or 'no parameters'}")
    values = {key: _value(name, one, parameters, bench) for key, one in known.items() if _is_told(one, parameters)}
    if missing := [key for key, one in known.items() if key not in values and one.default is MISSING]:
        raise UserError(f"expect: {name} needs {', '.join(missing)}")
    return kind(**values)


def expectation_kind(given: object) -> type[Expectation]:
    """The kind of an expectation as a scenario writes it. Raises UserError where there is none of that name."""
    name, _told = _parts(given)
    kind = library().get(name)
    if kind is None:
        raise UserError(f"expect: {name!r} is not an expectation; there are {', '.join(sorted(library()))}")
    return kind


def _parts(given: object) -> tuple[str, object]:
    match given:
        case str():
            return given, None
        case dict() if len(given) == 1:
            name, told = next(iter(given.items()))
            return str(name), told
    raise UserError(f"expect: expected a name, or one name with what belongs to it, not {given!r}")


def _parameters(kind: type[Expectation], told: object) -> dict[str, object]:
    if told is None:
        return {}
    if isinstance(told, dict):
        return dict(told)
    if kind.shorthand is None:
        raise UserError(f"expect: {kind.name} takes a mapping of its parameters, not {told!r}")
    return {kind.shorthand: told}


def _is_told(one: Field[Any], parameters: Mapping[str, object]) -> bool:
    return one.name in parameters or LIMIT in one.metadata


def _value(name: str, one: Field[Any], parameters: Mapping[str, object], bench: Bench) -> object:
    given = parameters.get(one.name, one.metadata.get(LIMIT))
    try:
        return _READERS[str(one.type)](given, bench)
    except ValueError as error:
        raise UserError(f"expect: {name}: {one.name}: {error}") from None


def _number(given: object, bench: Bench) -> float:
    if isinstance(given, str):
        given = bench.limit(given)
    if isinstance(given, bool) or not isinstance(given, int | float):
        raise ValueError(f"expected a number or the name of a limit of the bench, not {given!r}")
    return float(given)


def _optional_number(given: object, bench: Bench) -> float | None:
    return None if given is None else _number(given, bench)


def _by_axis(given: object, bench: Bench) -> dict[str, float]:
    if isinstance(given, str):
        given = bench.limit(given)
    if isinstance(given, dict):
        axes = {str(axis): _number(value, bench) for axis, value in given.items()}
        if unknown := sorted(set(axes) - set(bench.axes)):
            raise ValueError(f"{bench.machine_name} has no axis {unknown[0]!r}, only {', '.join(bench.axes)}")
        return axes
    return dict.fromkeys(bench.axes, _number(given, bench))


def _ranges(given: object, bench: Bench) -> dict[str, tuple[float, float]]:
    if isinstance(given, str):
        given = bench.limit(given)
    if not isinstance(given, dict):
        raise ValueError(f"expected lowest and highest for each axis, not {given!r}")
    ranges = {}
    for axis, pair in given.items():
        if axis not in bench.axes or not isinstance(pair, list | tuple) or len(pair) != 2:
            raise ValueError(f"expected [lowest, highest] for one of {', '.join(bench.axes)}, not {axis}: {pair!r}")
        ranges[str(axis)] = (_number(pair[0], bench), _number(pair[1], bench))
    return ranges


def _text(given: object, bench: Bench) -> str:  # noqa: ARG001  # every reader gets the bench
    if not isinstance(given, str):
        raise ValueError(f"expected a word, not {given!r}")
    return given


def _texts(given: object, bench: Bench) -> tuple[str, ...]:
    return tuple(_text(one, bench) for one in (given if isinstance(given, list) else [given]))


def _truth(given: object, bench: Bench) -> bool:  # noqa: ARG001
    if not isinstance(given, bool):
        raise ValueError(f"expected true or false, not {given!r}")
    return given


_READERS: Mapping[str, Callable[[object, Bench], object]] = {
    "float": _number,
    "float | None": _optional_number,
    "ByAxis": _by_axis,
    "Ranges": _ranges,
    "str": _text,
    "tuple[str, ...]": _texts,
    "bool": _truth,
}
"""By the annotation of the field."""
