"""What columns span: by it their part is taken off others."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def orthonormal(columns: Array) -> Array:
    """Orthonormal columns (N, at most q) of what columns (N, q) span, whatever their units."""
    vectors, sizes, _ = np.linalg.svd(columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300), full_matrices=False)
    return np.asarray(vectors[:, sizes > 1e-6])
