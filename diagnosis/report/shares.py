"""How the energy of a gap is divided up on motion that was not fitted: each effect, the unknown, noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.report.result import NOISE, UNKNOWN, Share

Array = NDArray[np.float64]

BLOCK = 1.0
"""Of contiguous time that is drawn together [s]."""
DRAWS = 400


def shares(
    gaps: Sequence[Array],
    parts: Sequence[Sequence[Array]],
    names: Sequence[str],
    periods: Sequence[float],
    noise_rms: float,
    seed: int,
) -> tuple[Share, ...]:
    """What is left with all effects is noise, up to the noise's square, and the unknown; what is gone the effects share.

    Each has its Shapley value of it: what it takes on average over all orders in which the effects are added, their torque as
    it is (Shapley 1953; for variances Lindeman, Merenda and Gold 1980). Where that is below 0, the effect undoes what others
    do: these lose as much, for what two take from each other is no share of either. `gaps` (n,) of each recording over samples
    that count, `parts` of each effect the same, `periods` [s]. Intervals from blocks of a second drawn anew (Carlstein 1986).
    """
    sums = [
        _block_sums(gap, [part[k] for part in parts], period) for k, (gap, period) in enumerate(zip(gaps, periods, strict=True))
    ]
    table = np.vstack(sums) if sums else np.zeros((0, 3 + len(names) * (1 + len(names))))
    if not len(table) or table[:, 0].sum() <= 0.0:
        return ()
    drawn = np.random.default_rng(seed).integers(len(table), size=(DRAWS, len(table)))
    found = _divided(table.sum(axis=0)[None], noise_rms, len(names))[0]
    spread = _divided(table[drawn].sum(axis=1), noise_rms, len(names))
    low, high = np.quantile(spread, (0.05, 0.95), axis=0)
    return tuple(
        Share(name, float(share), (float(min(a, share)), float(max(b, share))))
        for name, share, a, b in zip([*names, UNKNOWN, NOISE], found, low, high, strict=True)
    )


def _divided(sums: Array, noise_rms: float, count: int) -> Array:
    """Shares (draws, effects + 2) of sums (draws, 3 + effects + effects²): energy before and after, time, products of effects
    and gap, and of effects.
    """
    energy = np.maximum(sums[:, 0], 1e-300)
    left = np.minimum(sums[:, 1] / energy, 1.0)
    noise = np.minimum(noise_rms**2 * sums[:, 2] / energy, left)
    products = sums[:, 3 + count :].reshape(len(sums), count, count)
    named = _undone(2.0 * sums[:, 3 : 3 + count] - products.sum(axis=2), products)
    total = named.sum(axis=1, keepdims=True)
    named *= (1.0 - left)[:, None] / np.maximum(total, 1e-300)
    unknown = left - noise + np.where(total[:, 0] > 0.0, 0.0, 1.0 - left)
    whole = np.column_stack([named, unknown, noise])
    return np.asarray(whole / whole.sum(axis=1, keepdims=True))


def _undone(values: Array, products: Array) -> Array:
    """Shapley values (draws, effects), those below 0 taken off the effects that oppose them, by how much they do."""
    below, against = np.minimum(values, 0.0), np.maximum(-products, 0.0) * (values > 0.0)[:, None, :]
    parts = against / np.maximum(against.sum(axis=2, keepdims=True), 1e-300)
    return np.asarray(np.maximum(np.maximum(values, 0.0) + np.einsum("di,dij->dj", below, parts), 0.0))


def _block_sums(gap: Array, parts: Sequence[Array], period: float) -> Array:
    if not len(gap):
        return np.zeros((0, 3 + len(parts) * (1 + len(parts))))
    left = gap - sum(parts, np.zeros(len(gap)))
    each = [part * other for part in parts for other in parts]
    columns = np.column_stack([gap**2, left**2, np.ones(len(gap)), *(part * gap for part in parts), *each])
    starts = np.arange(0, len(gap), max(1, round(BLOCK / period)))
    return np.asarray(np.add.reduceat(columns * period, starts, axis=0))
