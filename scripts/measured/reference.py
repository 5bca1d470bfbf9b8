"""The reference: plain least squares of the columns that matter, fitted on the training recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import pyarrow.parquet as pq
from scipy.optimize import lsq_linear

from drivetwin.foundation.errors import UserError
from measured.columns import Choice, Column
from measured.motion import Array, Band, Mask, Motion, read_motion
from measured.recipes import Recipe

RIDGE = 1e-7
"""Of a column's norm: keeps columns that are the same on the training recordings from growing against each other."""


@dataclass(frozen=True)
class Judged:
    """What is predicted on one validation recording: torque (n,) [N·m or N], of which the samples `used` count.

    `after` is the diagnosis's; where there is none, what is `before`.
    """

    before: Array
    after: Array
    measured: Array
    used: Mask


@dataclass(frozen=True)
class Reference:
    """Gap on the validation recordings, rms over samples in use, weighted by duration [N·m or N].

    torque, before, diagnosed: of the measured torque, of the gap, and of what the diagnosis leaves of it, as the diagnosis
    reads the torque, which may be earlier than recorded. recorded, after: of the gap as recorded, and of what the reference
    leaves of it. carried: the same with nothing fitted in the validation recordings themselves; it is `after` unless
    `within_file`. band, fitted and within_file say what the reference is.
    """

    band: Band
    fitted: str
    within_file: str
    torque: float
    before: float
    diagnosed: float
    recorded: float
    after: float
    carried: float

    @property
    def closed(self) -> float:
        """1 - (after / recorded)²."""
        return closed(self.recorded, self.after)

    @property
    def closed_by_diagnosis(self) -> float:
        """1 - (diagnosed / recorded)²: of the same gap as the reference."""
        return closed(self.recorded, self.diagnosed)

    @property
    def closed_carried(self) -> float:
        """The same of `carried`."""
        return closed(self.recorded, self.carried)


def closed(before: float, after: float) -> float:
    """1 - (after / before)²; 0 where there is no gap."""
    return 1.0 - (after / before) ** 2 if before > 0.0 else 0.0


def reference(
    recipe: Recipe, model: Path, training: Sequence[Path], validation: Sequence[Path], band: Band, prediction: Path | None
) -> Reference:
    """Fit `recipe` on the training recordings and hold it against the validation recordings.

    With `prediction`, the folder that a diagnosis wrote, gap and samples are that diagnosis's; without, they are those of the
    simulation `model` as it stands, computed here. Raises UserError where a prediction is missing or not of its recording.
    """
    fitted_on = [read_motion(path, band) for path in training]
    asked = [read_motion(path, band) for path in validation]
    judged = [_simulated(model, motion) if prediction is None else _predicted(prediction, motion) for motion in asked]
    if recipe.at_mean_speed:
        slow = [motion.at_mean_speed() for motion in fitted_on]
        carried_on = [motion.at_mean_speed() for motion in asked]
    else:
        slow, carried_on = fitted_on, asked
    choice, parameters = fit(recipe.columns, recipe.choices, slow)
    columns = (*recipe.columns, *choice.columns)
    left = [motion.torque - _design(columns, motion) @ parameters for motion in carried_on]
    within = [_without(recipe.within_file, *each) for each in zip(left, asked, judged, strict=True)]
    return Reference(
        band=band,
        fitted=_names(columns) + (f" ({choice.name})" if choice.name else ""),
        within_file=_names(recipe.within_file),
        torque=_rms([one.measured for one in judged], asked, judged),
        before=_rms([one.measured - one.before for one in judged], asked, judged),
        diagnosed=_rms([one.measured - one.after for one in judged], asked, judged),
        recorded=_rms([motion.torque - one.before for one, motion in zip(judged, asked, strict=True)], asked, judged),
        after=_rms(within, asked, judged),
        carried=_rms(left, asked, judged),
    )


def fit(columns: Sequence[Column], choices: Sequence[Choice], motions: Sequence[Motion]) -> tuple[Choice, Array]:
    """The choice with the least squares over the fitted samples, weighted by duration, and its parameters (k,).

    Raises ValueError where the fitted samples show none of the choices.
    """
    weight = np.concatenate([np.full(int(motion.fitted.sum()), np.sqrt(motion.period)) for motion in motions])
    torque = weight * np.concatenate([motion.torque[motion.fitted] for motion in motions])
    same = _rows(columns, motions, weight)
    found = []
    for choice in choices:
        if not all(_shown(column, motions) for column in choice.columns):
            continue
        rows = np.column_stack([same, _rows(choice.columns, motions, weight)])
        parameters = _bounded(rows, torque, [column.least for column in (*columns, *choice.columns)])
        found.append((float(np.sum((torque - rows @ parameters) ** 2)), parameters, choice))
    _, parameters, choice = min(found, key=lambda each: each[0])
    return choice, parameters


def _shown(column: Column, motions: Sequence[Motion]) -> bool:
    """Whether the fitted samples show as much of a column as it needs."""
    most = (float(np.abs(column.of(motion)[motion.fitted]).max(initial=0.0)) for motion in motions)
    return max(most, default=0.0) >= column.shown


def _rows(columns: Sequence[Column], motions: Sequence[Motion], weight: Array) -> Array:
    parts = [_design(columns, motion)[motion.fitted] for motion in motions]
    return np.asarray(weight[:, None] * np.concatenate(parts))


def _design(columns: Sequence[Column], motion: Motion) -> Array:
    """(n, k)."""
    rows = np.empty((len(motion.raw), len(columns)))
    for k, column in enumerate(columns):
        rows[:, k] = column.of(motion)
    return rows


def _bounded(rows: Array, torque: Array, least: Sequence[float]) -> Array:
    """Least squares with every parameter at least `least`, on columns of norm 1."""
    norm = np.linalg.norm(rows, axis=0)
    norm[norm == 0.0] = 1.0
    orthogonal, triangle = np.linalg.qr(rows / norm)
    size = len(norm)
    matrix = np.vstack([triangle, RIDGE * np.eye(size)])
    target = np.concatenate([orthogonal.T @ torque, np.zeros(size)])
    found = lsq_linear(matrix, target, bounds=(np.array(least), np.full(size, np.inf)), method="bvls")
    return np.asarray(found.x / norm, dtype=np.float64)


def _without(columns: Sequence[Column], left: Array, motion: Motion, judged: Judged) -> Array:
    """What is left (n,) once `columns` are fitted in the recording itself; its mean is not theirs to take."""
    if not columns:
        return left
    rows = np.column_stack([_design(columns, motion), np.ones(len(left))])
    parameters = np.linalg.lstsq(rows[judged.used], left[judged.used], rcond=None)[0]
    return np.asarray(left - rows[:, :-1] @ parameters[:-1])


def _names(columns: Sequence[Column]) -> str:
    return ", ".join(dict.fromkeys(column.name for column in columns))


def _rms(errors: Sequence[Array], motions: Sequence[Motion], judged: Sequence[Judged]) -> float:
    """Over the samples in use of all recordings, weighted by duration."""
    pairs = [(motion.period, error[one.used]) for error, motion, one in zip(errors, motions, judged, strict=True)]
    duration = sum(period * len(error) for period, error in pairs)
    return float(np.sqrt(sum(period * float(error @ error) for period, error in pairs) / duration)) if duration else 0.0


def _predicted(folder: Path, motion: Motion) -> Judged:
    file = folder / f"{motion.name}.parquet"
    if not file.is_file():
        raise UserError(f"{file} is missing; a report comes with the prediction of every validation recording")
    table = pq.read_table(file)
    axis = next((name.removesuffix(".used") for name in table.column_names if name.endswith(".used")), None)
    needed = ("torque_before", "torque_after", "torque_measured", "used")
    if axis is None or not {f"{axis}.{name}" for name in needed} <= set(table.column_names):
        raise UserError(f"{file} lacks one of {', '.join(needed)}; it has {', '.join(table.column_names)}")
    if len(table) != len(motion.raw):
        raise UserError(f"{file} has {len(table)} rows, its recording {len(motion.raw)}; it is on the recording's own time")
    before, after, measured = (np.asarray(table.column(f"{axis}.{name}"), dtype=np.float64) for name in needed[:3])
    return Judged(before, after, measured, np.asarray(table.column(f"{axis}.used"), dtype=np.bool_))


def _simulated(model: Path, motion: Motion) -> Judged:
    """The simulation as it stands on a measured motion, by MuJoCo's inverse dynamics of its one joint."""
    mechanics = mujoco.MjModel.from_xml_path(str(model))
    coulomb, viscous = float(mechanics.dof_frictionloss[0]), float(mechanics.dof_damping[0])
    mechanics.dof_frictionloss[:] = mechanics.dof_damping[:] = 0.0
    still, quarter, pushed = (_inverse(mechanics, *state) for state in ((0.0, 0.0), (0.5 * np.pi, 0.0), (0.0, 1.0)))
    hinge = mechanics.jnt_type[0] == mujoco.mjtJoint.mjJNT_HINGE
    weight = still * np.cos(motion.position) + quarter * np.sin(motion.position) if hinge else still
    friction = coulomb * motion.smooth(np.sign(motion.velocity)) + viscous * motion.velocity
    before = np.asarray((pushed - still) * motion.acceleration + weight + friction, dtype=np.float64)
    return Judged(before, before, motion.torque, motion.fitted)


def _inverse(model: mujoco.MjModel, position: float, acceleration: float) -> float:
    data = mujoco.MjData(model)
    data.qpos[0], data.qacc[0] = position, acceleration
    mujoco.mj_inverse(model, data)
    return float(data.qfrc_inverse[0])
