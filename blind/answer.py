"""What a diagnosis answered to one case, read from its report, and the gaps recomputed from its predictions."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from drivetwin.blind.told import Told, read_told
from drivetwin.foundation.errors import UserError

NOMINALS = ("exact", "off")
"""Nominal parameters of the model that the diagnosis is given: the machine's own, or each some 4 % off."""

REPORT, FAILED = "report.json", "failed.json"
PREDICTION, FRESH = "prediction", "fresh"
ALIKE = "alike.json"
"""What came of the claims that an effect is indistinguishable from a true one, once the key is open."""


@dataclass(frozen=True)
class Gap:
    """Gap of an axis without and with what was found, and its noise: rms over the samples that count [N·m or N]."""

    before: float
    after: float
    noise: float

    @property
    def closed(self) -> float:
        """1 - (after / before)^2, contract gap-report; 0 where there was no gap."""
        return 1.0 - (self.after / self.before) ** 2 if self.before > 0.0 else 0.0

    @property
    def of_explainable(self) -> float | None:
        """The same with the noise's energy taken off both, at most 1; None where there was nothing above noise."""
        explainable, left = self.before**2 - self.noise**2, max(0.0, self.after**2 - self.noise**2)
        return 1.0 - left / explainable if explainable > 0.0 else None


@dataclass(frozen=True)
class Answer:
    """All that is scored of one diagnosis.

    `gaps`: by axis on the validation motion, with all selected effects. `fresh`: by axis on motion that the diagnosis never
    saw, with the first cause alone; empty where it predicts nothing. `failed`: why there is no report, which is None then.
    `alike`: effect, axis and true effect of what called itself indistinguishable and is so by the fit (`alike.py`); `checked`:
    how many such claims were tried.
    """

    report: Told | None
    gaps: Mapping[str, Gap]
    fresh: Mapping[str, Gap]
    failed: str | None
    alike: frozenset[tuple[str, str, str]] = frozenset()
    checked: int = 0


def answered(folder: Path) -> bool:
    """Whether the diagnosis of which `folder` holds the outcome was done; one that failed is tried again."""
    return (folder / REPORT).exists() and not (folder / FAILED).exists()


def tried(folder: Path) -> bool:
    """Whether the diagnosis of which `folder` holds the outcome was done or has failed."""
    return (folder / REPORT).exists() or (folder / FAILED).exists()


def read_answer(folder: Path) -> Answer:
    """The answer that OUT/cases/NNN/NOMINAL holds. A report that breaks the contract has failed."""
    if (folder / FAILED).exists():
        return Answer(None, {}, {}, str(json.loads((folder / FAILED).read_text(encoding="utf-8"))["failed"]))
    try:
        report = read_told(folder / REPORT)
        noise = {axis: entry.noise_rms for axis, entry in report.axes.items()}
        gaps = measure(sorted((folder / PREDICTION).glob("*.parquet")), noise)
        fresh = measure(sorted((folder / FRESH).glob("*.parquet")), noise)
    except (UserError, pa.ArrowException, KeyError) as error:
        return Answer(None, {}, {}, f"the contract is broken: {error}")
    claims = _claims(folder / ALIKE)
    alike = frozenset((one["effect"], one["axis"], one["truth"]) for one in claims if one["holds"])
    return Answer(report, gaps, fresh, None, alike, len(claims))


def _claims(path: Path) -> list[dict[str, Any]]:
    """What alike.json says; nothing where no claim was tried."""
    return list(json.loads(path.read_text(encoding="utf-8"))["claims"]) if path.exists() else []


def measure(predictions: Iterable[Path], noise: Mapping[str, float]) -> dict[str, Gap]:
    """Gap by axis over all `predictions` (prediction/NAME.parquet of a gap report) together; KeyError: a column misses."""
    tables = [pq.read_table(path) for path in predictions]
    if not tables:
        return {}
    return {
        axis: Gap(_gap_rms(tables, axis, "torque_before"), _gap_rms(tables, axis, "torque_after"), noise_rms)
        for axis, noise_rms in noise.items()
        if f"{axis}.used" in tables[0].column_names
    }


def _gap_rms(tables: list[pa.Table], axis: str, predicted: str) -> float:
    """Rms of measured less predicted torque over the samples in use of all tables."""
    columns = [
        tuple(table.column(f"{axis}.{name}").to_numpy() for name in (predicted, "torque_measured", "used")) for table in tables
    ]
    gap = np.concatenate([(measured - torque)[used.astype(bool)] for torque, measured, used in columns])
    if not np.isfinite(gap).all():
        raise UserError(f"{axis}.{predicted} or {axis}.torque_measured of a prediction is not finite where {axis}.used is true")
    return float(np.sqrt(np.mean(gap**2))) if gap.size else 0.0
