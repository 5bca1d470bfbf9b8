"""Effects on the rigid bodies: what they cost is a polynomial in their parameters, told by changed models' inverse dynamics.

A point mass m at p costs m times a quadratic in p (kinetic energy m |v + w x p|² / 2, potential m g p), a coupling inertia J of
ratio r costs J times a quadratic in r. So ten and three evaluations tell all of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.model.system import System
from drivetwin.diagnosis.prepare.rows import Rows
from drivetwin.diagnosis.propose.search import Begun
from drivetwin.emulator.effects import Effect, ModelEffect
from drivetwin.foundation.errors import UserError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Polynomial:
    """Torque of one kind of effect on one axis: size times the monomials of its shape; `terms[axis]` is (N, monomials)."""

    kind: type[ModelEffect]
    terms: dict[str, Array]

    def column(self, effect: Effect) -> dict[str, Array]:
        """What an effect costs on the compared rows of every axis."""
        size, shape = _size_and_shape(effect)
        weights = size * _monomials(shape)
        return {axis: terms @ weights for axis, terms in self.terms.items()}


def polynomial(rows: Rows, axis: str, kind: type[ModelEffect]) -> Polynomial | None:
    """None where the axis cannot have the effect, or nothing is felt of it."""
    count = len(kind.parameters) - 1
    probes = _probes(count) * kind.probe
    try:
        costs = [rows.predicted_by_model(axis, _made(kind, 1.0, probe)) for probe in probes]
    except UserError:
        return None
    inverse = np.linalg.inv(np.array([_monomials(probe) for probe in probes]))
    terms = {name: np.column_stack([cost[name] for cost in costs]) @ inverse.T for name in costs[0]}
    felt = any(np.abs(rows).max(initial=0.0) > 1e-9 for rows in terms.values())
    return Polynomial(kind, terms) if felt else None


def rigid_starts(system: System, axis: str, known: Polynomial, held: frozenset[int]) -> list[Begun]:
    """The starts of an effect on the rigid bodies, best first, sized by least squares; those that cost the same once."""
    found: list[tuple[Begun, dict[str, Array]]] = []
    for shape in _shapes(known.kind):
        column = known.column(_made(known.kind, 1.0, shape))
        if not any(np.abs(part).max(initial=0.0) > 1e-9 for part in column.values()):
            continue
        fit = system.fit([system.whiten(column)], held=held)
        size = float(fit.coefficients[-1])
        if size > 0.0:
            scaled = {name: size * part for name, part in column.items()}
            found.append((Begun(axis, _made(known.kind, size, shape), fit.evidence, 1), scaled))
    kept: list[tuple[Begun, dict[str, Array]]] = []
    for begun, column in sorted(found, key=lambda one: -one[0].evidence):
        if not any(_same(column, other) for _, other in kept):
            kept.append((begun, column))
    return [replace(begun, tried=len(kept)) for begun, _ in kept]


def _same(one: dict[str, Array], other: dict[str, Array]) -> bool:
    size = max(float(np.abs(rows).max(initial=0.0)) for rows in other.values())
    return all(float(np.abs(one[axis] - rows).max(initial=0.0)) <= 1e-3 * size for axis, rows in other.items())


def _shapes(kind: type[ModelEffect]) -> list[Array]:
    """One shape parameter at a time away from nothing; of a payload also the corners in its x-y plane."""
    values, count = kind.shapes, len(kind.parameters) - 1
    if count == 1:
        return [np.array([value]) for value in values]
    shapes = [np.zeros(count)]
    for k in range(count):
        for value in values[1:]:
            shape = np.zeros(count)
            shape[k] = value
            shapes.append(shape)
    return shapes


def _made(kind: type[ModelEffect], size: float, shape: Sequence[float] | Array) -> ModelEffect:
    names = [parameter.name for parameter in kind.parameters]
    return kind(**dict(zip(names, [size, *(float(value) for value in shape)], strict=True)))


def _size_and_shape(effect: Effect) -> tuple[float, Array]:
    values = [float(getattr(effect, parameter.name)) for parameter in type(effect).parameters]
    return values[0], np.array(values[1:])


def _monomials(shape: Array) -> Array:
    """1, the shape parameters, their products: up to degree two."""
    rows, columns = np.triu_indices(len(shape))
    return np.concatenate([[1.0], shape, shape[rows] * shape[columns]])


def _probes(count: int) -> Array:
    """As many points as there are monomials, which tell all of them."""
    unit = np.eye(count)
    pairs = [unit[a] + unit[b] for a in range(count) for b in range(a + 1, count)]
    return np.array([np.zeros(count), *unit, *(-unit), *pairs])
