"""What `make wafer-handler` found, in the terminal: the paper's figures beside ours."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console
from rich.table import Table

from wafer_handler.results import PUBLISHED, Study, Times, learning_reduction


def print_summary(console: Console, study: Study, out: Path) -> None:
    """Tables, then where the report is."""
    title = "Without and with torque feed-forward (0: the band is never left)"
    table = Table("axis", "time", "paper [ms]", "ratio", "ours [ms]", "ratio", title=title)
    for axis, result in study.axes.items():
        for name, found in (("settling", result.settling), ("deceleration", result.deceleration)):
            table.add_row(axis, name, *_published(name, axis), *_ours(found))
    console.print(table)
    title = "Peak tracking error lower by a factor of"
    table = Table("axis", "torque", "torque by eq. 14", "then learning, 5 times", "learning after the full torque", title=title)
    for axis, result in study.axes.items():
        factors = (result.error_reduction, result.error_reduction_by_eq14)
        learned = (learning_reduction(result.learned), learning_reduction(result.learned_further))
        table.add_row(axis, *(f"{factor:.1f}" for factor in (*factors, *learned)))
    console.print(table)
    worst = max(abs(error) for error in study.base_errors.values())
    console.print(
        f"base parameters: worst {worst:.2%} off the plant's; dynamics: {study.dynamics.mujoco:.1e} from MuJoCo, "
        f"{study.dynamics.pinocchio:.1e} from Pinocchio; kinematics: {study.kinematics_error:.1e} m",
        highlight=False,
    )
    console.print(
        f"blade straight within {study.straight.straightness * 1e6:.0f} um; wafer's least margin against slipping "
        f"{min(phase.true_margin for phase in study.carried):.2f}",
        highlight=False,
    )
    console.print(f"report: {out / 'report.html'}", highlight=False)


def _published(name: str, axis: str) -> tuple[str, str]:
    without, with_torque = PUBLISHED[name][axis]
    return f"{without} -> {with_torque}", f"{with_torque / without:.2f}"


def _ours(found: Times) -> tuple[str, str]:
    return f"{1e3 * found.without:.0f} -> {1e3 * found.with_torque:.0f}", f"{found.ratio:.2f}"
