"""report.html: the paper's figures and tables, each beside its counterpart on the virtual machine."""

from __future__ import annotations

import html
from pathlib import Path

import mujoco

from drivetwin.controller.feedforward.stage import Stage
from drivetwin.emulator.machine import load_machine
from drivetwin.foundation.html_page import figure_div, table, write_page
from drivetwin.foundation.machine_picture import machine_picture
from drivetwin.identification.result import Parameter
from wafer_handler.blade_study import LINE, REACH, SAFETY, WAFER
from wafer_handler.figures import (
    MICRO,
    friction_figure,
    learned_figure,
    learning_figure,
    straightness_figure,
    torque_figure,
    tracking_figure,
)
from wafer_handler.metrics import Tracking
from wafer_handler.results import PUBLISHED, AxisResult, Study, Times, learning_reduction, times
from wafer_handler.scara.dynamics import PARAMETERS

TITLE = "The machine of the paper"
FIGURES = {"lift": "Fig. 5", "rotate": "Fig. 6", "stretch": "Fig. 7"}


def write_report(study: Study, path: Path) -> None:
    """Write the report to `path`, whole or not at all."""
    write_page(
        path,
        TITLE,
        [
            _header(),
            _machine(),
            _times(study),
            _errors(study),
            *(_axis(study, axis, result) for axis, result in study.axes.items()),
            _dynamics(study),
            _identification(study),
            _blade(study),
            _wafer(study),
            _by_offsets(study),
            _notes(),
        ],
    )


def _header() -> str:
    return (
        f"<header><h1>{TITLE}</h1><p>Zhao, Zou, Liu, Liu: Dynamics Modeling and Parameter Identification of Single Arm SCARA "
        "Manipulator, Machinery Design &amp; Manufacture 2016(3), 82-84, link by link on virtual drives. All motion and all "
        "captured torque went through the CAN bus; the plant has Stribeck friction, stiction and elastic belts.</p></header>"
    )


def _machine() -> str:
    machine = load_machine("scara")
    joints = {axis.joint for axis in machine.axes.values()}
    return _section("Machine", machine_picture(mujoco.MjModel.from_xml_path(str(machine.model_path)), joints))


def _times(study: Study) -> str:
    rows = []
    for axis, result in study.axes.items():
        eq14 = result.stages_of_eq14
        for name, found, by_eq14 in (
            ("settling", result.settling, times(Tracking.settling_time, eq14)),
            ("deceleration", result.deceleration, times(Tracking.deceleration_time, eq14)),
        ):
            without, with_torque = PUBLISHED[name][axis]
            published = (f"{without}", f"{with_torque}", f"{with_torque / without:.2f}")
            rows.append((axis, name, *published, *_row(found), f"{1e3 * by_eq14.with_torque:.0f}", f"{by_eq14.ratio:.2f}"))
    head = (
        *("Axis", "Time", "paper: without", "with [ms]", "ratio", "ours: without", "with [ms]", "ratio"),
        *("eq. 14 [ms]", "ratio"),
    )
    return _section(
        "Table 2: settling and deceleration time",
        table(head, rows, numeric=range(2, 10)),
        "Without: the velocity fed forward. With: velocity and torque of the identified arm and its friction; the last two "
        "columns: with the friction of eq. 14 alone, Coulomb and viscous. Settling: from the start until the tracking "
        "difference stays within 5 % of the baseline's peak around its cruise value; deceleration: from the start of "
        "deceleration until it stays in the same band around zero. 0 where it never leaves it. An axis that eq. 14 lets stop "
        "too early stands beside its demand, held by stiction, until its integrator has the torque to break it.",
    )


def _errors(study: Study) -> str:
    peaks, factors = [], []
    for axis, result in study.axes.items():
        shown = (*(result.stages[stage] for stage in Stage), result.eq14, result.learned[-1], result.learned_further[-1])
        peaks.append((axis, MICRO[axis], *(f"{1e6 * found.peak:,.1f}" for found in shown)))
        lower = (result.error_reduction, result.error_reduction_by_eq14)
        learned = (learning_reduction(result.learned), learning_reduction(result.learned_further))
        factors.append((axis, *(f"{factor:.1f}" for factor in (*lower, *learned))))
    head = ("Axis", "Unit", "none", "velocity", "and torque", "and torque, eq. 14", "this, learned", "full torque, learned")
    by = ("Axis", "torque", "torque by eq. 14", "learning after eq. 14", "learning after the full torque")
    return _section(
        "Peak tracking error",
        table(head, peaks, numeric=range(2, 8)) + "<h3>Lower by a factor of</h3>" + table(by, factors, numeric=range(1, 5)),
        "Torque: against velocity alone. Learning: the peak after five repetitions against that of its own first run, which "
        "has learned nothing. After the full torque there is hardly more to learn than the noise of the torque at rest.",
    )


def _axis(study: Study, axis: str, result: AxisResult) -> str:
    true, found, eq14 = study.true_laws[axis], study.identified, study.eq14.laws[axis]
    pictures = (
        (f"{FIGURES[axis]}: tracking difference", tracking_figure(axis, result.stages, result.eq14)),
        ("Learning over repetitions", learning_figure(axis, result)),
        ("Before and after learning", learned_figure(axis, result)),
        ("Fig. 3: friction over speed", friction_figure(axis, found.curves[axis], found.laws[axis], eq14, true)),
    )
    return _section(f"Axis {axis}", "".join(f"<h3>{title}</h3>{figure_div(figure)}" for title, figure in pictures))


def _dynamics(study: Study) -> str:
    rows = [
        ("kinematics: tool point from MuJoCo's, and through the inverse and back [m]", f"{study.kinematics_error:.1e}"),
        ("dynamics: max |a - b| / max |b| from MuJoCo's inverse dynamics", f"{study.dynamics.mujoco:.1e}"),
        ("dynamics: the same from Pinocchio's", f"{study.dynamics.pinocchio:.1e}"),
    ]
    shown = table(("On random states over the workspace", "greatest difference"), rows, numeric=(1,))
    return _section("Fig. 4: calculated against toolbox", shown + figure_div(torque_figure(study.compared)))


def _identification(study: Study) -> str:
    rows = [
        (meaning.symbol, meaning.meaning, meaning.unit, *_estimate(found, study.true_base[meaning.name]))
        for meaning in PARAMETERS
        if (found := study.identified.parameters.get(meaning.name)) is not None
    ]
    for axis, parameters in study.identified.friction.items():
        true = study.true_laws[axis]
        rows += [
            (axis, name.replace("_", " "), found.unit, *_estimate(found, getattr(true, name)))
            for name, found in parameters.items()
        ]
    head = ("parameter", "what it is", "unit", "identified", "90 % interval", "true", "error", "in interval")
    return _section(
        "Base parameters and friction, from captured torque",
        table(head, rows, numeric=range(3, 7)),
        "One regression over strokes, excitation of each axis, and all axes moving together. The controller's drawing is 2 to "
        "3 % off the machine; the moments across forearm and blade are left out where nothing proves them. The intervals are "
        "of the noise: what the belts and half a servo period between position and torque do to a rigid model, some 0.1 %, "
        "comes on top, so that fewer than nine in ten hold the truth. The lift's offset is its weight.",
    )


def _blade(study: Study) -> str:
    peaks = [(stage.value, f"{1e6 * float(off.max()):.0f}") for stage, off in study.straight.off.items()]
    shown = table(("feed-forward", "greatest true distance from the line [um]"), peaks, numeric=(1,))
    return _section(
        "The blade on a straight line",
        shown + figure_div(straightness_figure(study.straight)),
        f"Stretch move from {REACH[0]:g} to {REACH[1]:g} m from the column, up to {LINE.speed:g} m/s and "
        f"{LINE.acceleration:g} m/s². The blade's position is the plant's own: the encoders do not see how the belts give way.",
    )


def _wafer(study: Study) -> str:
    rows = [
        (phase.phase.value, f"{phase.seconds:.2f}", _margin(phase.planned_margin), _margin(phase.true_margin))
        for phase in study.carried
    ]
    return _section(
        "A wafer carried from station to station",
        table(("phase", "time [s]", "planned margin", "true margin"), rows, numeric=range(1, 4)),
        f"Margin: friction that the pads give over what the motion takes; below 1 the wafer may slip. mu = {WAFER.friction:g} "
        f"(an assumption), a blade that may lean by 1 degree, planned for {SAFETY:g}. The true margin is of the acceleration "
        "that the wafer's centre truly has, up to 60 Hz.",
    )


def _margin(value: float) -> str:
    """A phase that hardly takes any friction has no margin worth a number."""
    return f"{value:.2f}" if value < 100.0 else "&ndash;"


def _by_offsets(study: Study) -> str:
    rows = []
    for axis, stages in study.by_offsets.items():
        baseline = stages[Stage.VELOCITY]
        for name, of in (("settling", type(baseline).settling_time), ("deceleration", type(baseline).deceleration_time)):
            rows.append((axis, name, *_row(times(of, stages)), f"{baseline.peak / stages[Stage.TORQUE].peak:.1f}"))
    head = ("Axis", "Time", "without [ms]", "with [ms]", "ratio", "peak error lower by")
    return _section(
        "The same on drives of the full CiA 402 profile",
        table(head, rows, numeric=range(2, 6)),
        "Cyclic synchronous position, velocity as 60B1h and torque (with Stribeck) as 60B2h, both streamed with the set-points "
        "in a cycle of 2 ms: with 60B1h, three axes no longer fit into 1 ms of 1 Mbit/s.",
    )


def _notes() -> str:
    return _section(
        "What cannot be reproduced",
        "<ul><li>The paper prints no masses, lengths or gains. Ours are those of a 300 mm wafer handler as such machines are "
        "built; the drives' gains are those that the identification used before. The belts' stiffness and the frequencies up "
        "to which each axis learns came with this study. Absolute milliseconds do not compare, ratios do.</li>"
        "<li>The paper sees no effect of the velocity alone, so its two curves, and ours, compare velocity with velocity and "
        "torque.</li><li>Errata of the paper, and how every quantity is defined: docs/wafer-handler.md.</li></ul>",
    )


def _row(found: Times) -> tuple[str, str, str]:
    return f"{1e3 * found.without:.0f}", f"{1e3 * found.with_torque:.0f}", f"{found.ratio:.2f}"


def _estimate(found: Parameter, true: float) -> tuple[str, str, str, str, str]:
    error = f"{100.0 * (found.value / true - 1.0):+.2f} %" if true else "&ndash;"
    low, high = found.interval
    inside = "yes" if low <= true <= high else "no"
    return f"{found.value:.4g}", f"{low:.4g} &hellip; {high:.4g}", f"{true:.4g}", error, inside


def _section(title: str, body: str, note: str = "") -> str:
    return f"<section><h2>{html.escape(title)}</h2>{body}" + (f'<p class="note">{note}</p>' if note else "") + "</section>"
