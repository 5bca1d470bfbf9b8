"""How long a diagnosis takes: its fit beside mujoco.sysid's on one recording, and five minutes of three axes."""

from __future__ import annotations

import contextlib
import os
import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TypeVar

import can
import mujoco
import numpy as np
from mujoco import rollout, sysid
from numpy.typing import NDArray
from rich.table import Table

from drivetwin.bus.channel import InprocBus
from drivetwin.controller.machine import load_machine
from drivetwin.controller.pacing import Lockstep
from drivetwin.controller.progress import Progress
from drivetwin.controller.session import session_on
from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.excitation.choice import Question
from drivetwin.diagnosis.excitation.limits import AxisLimits
from drivetwin.diagnosis.excitation.plan import plan
from drivetwin.diagnosis.prepare.prepared import prepared
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.bench import bench_of
from drivetwin.diagnosis.weigh.state import state_of
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.motion.jerk_limited import MotionLimits
from drivetwin.recording.recording import AxisInfo, Recording, RecordingInfo

Array = NDArray[np.float64]
T = TypeVar("T")

SYSID_IS_THERE = hasattr(sysid, "optimize")
"""Without the packages of `mujoco[sysid]` it imports as an empty shell."""

SAMPLE, STEP = 0.001, 0.00025
"""Of the recording and of the plant that is recorded [s]."""
POSITION_GAIN, VELOCITY_GAIN = 60.0, 3000.0
"""Of the stage's loops [1/s; N·s/m]: force = velocity_gain (position_gain (demand - position) + demand's speed - velocity)."""
NOISE, QUANTUM = 0.3, 1e-6
"""Of the force, rms [N], and of the encoder [m]."""
LIMITS = AxisLimits((-0.2, 0.2), MotionLimits(0.5, 4.0, 80.0))
CUTOFF = 48.0
SAME = 1.02
"""Times the diagnosis's error: the same."""
MOST, DEFAULT = 10, 200
"""Iterations that mujoco.sysid is given to reach it, and by default."""
MINUTES = 5.0


@dataclass(frozen=True)
class Stage:
    """Coulomb [N], viscous [N·s/m] and mass [kg] of the stage."""

    coulomb: float
    viscous: float
    mass: float

    def off(self, other: Stage) -> float:
        """Largest relative difference of a parameter."""
        pairs = zip(self.vector, other.vector, strict=True)
        return max(abs(one / two - 1.0) for one, two in pairs)

    @property
    def vector(self) -> tuple[float, float, float]:
        """In the order of the fields."""
        return self.coulomb, self.viscous, self.mass


TRUE, NOMINAL = Stage(25.0, 160.0, 46.0), Stage(20.0, 200.0, 40.0)


@dataclass(frozen=True)
class Fitted:
    """What one of the two made of the recording: parameters, seconds, rms of the force error on a recording not fitted [N]."""

    name: str
    stage: Stage
    seconds: float
    error: float


@dataclass(frozen=True)
class BesideSysid:
    """Both fits of one recording; `stopped` after the fewest iterations to the same error; `whole`: with every effect."""

    ours: Fitted
    stopped: Fitted
    by_default: Fitted
    whole_seconds: float

    @property
    def ratio(self) -> float:
        """Seconds that mujoco.sysid takes to the same error, over those of the diagnosis's fit."""
        return self.stopped.seconds / self.ours.seconds


def beside_sysid(seconds: float, rounds: int) -> BesideSysid:
    """Both fits on one recording, alternating; medians of their seconds."""
    fitted, other = _moved(seconds, ("stribeck", "viscous", "inertia")), _moved(20.0, ("spring", "inertia"))
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / "stage.xml"
        model.write_text(_mjcf(NOMINAL, SAMPLE), encoding="utf-8")
        _by_diagnosis(model, fitted)  # compiles
        aim = SAME * _error(model, _by_diagnosis(model, fitted), other)
        fewest = next((n for n in range(1, MOST) if _error(model, _by_sysid(model, fitted, n), other) <= aim), MOST)
        ways: dict[str, Callable[[], Stage]] = {
            "diagnosis": lambda: _by_diagnosis(model, fitted),
            f"mujoco.sysid, {fewest} iterations: the same error": lambda: _by_sysid(model, fitted, fewest),
            "mujoco.sysid until it ends by itself": lambda: _by_sysid(model, fitted, DEFAULT),
        }
        runs = [[_timed(way) for way in ways.values()] for _ in range(rounds)]
        whole = _timed(lambda: _diagnosed(model, fitted))[1]
        ours, stopped, by_default = (
            Fitted(name, column[0][0], statistics.median(took for _, took in column), _error(model, column[0][0], other))
            for name, column in zip(ways, zip(*runs, strict=True), strict=True)
        )
    return BesideSysid(ours, stopped, by_default, whole)


def fits_table(found: BesideSysid, seconds: float) -> Table:
    """Both fits as rows."""
    table = Table(f"{seconds:.0f} s at 1 kHz: Coulomb, viscous, mass", "seconds", "worst parameter", "error elsewhere, N")
    for one in (found.ours, found.stopped, found.by_default):
        table.add_row(one.name, f"{one.seconds:.3f}", f"{100.0 * one.stage.off(TRUE):.2f} %", f"{one.error:.3f}")
    table.add_row("the whole diagnosis: every effect", f"{found.whole_seconds:.3f}", "", "")
    return table


def _timed(made: Callable[[], T]) -> tuple[T, float]:
    began = time.perf_counter()
    found = made()
    return found, time.perf_counter() - began


def _mjcf(stage: Stage, step: float) -> str:
    """The stage with its loops as one actuator, whose control is demand + demand's speed / position_gain."""
    stiff = POSITION_GAIN * VELOCITY_GAIN
    return f"""<mujoco model="stage"><option timestep="{step}" gravity="0 0 0" integrator="Euler"/><worldbody>
      <body name="carriage"><inertial pos="0 0 0" mass="{stage.mass}" diaginertia="1 1 1"/>
      <joint name="axis" type="slide" axis="1 0 0" damping="{stage.viscous}" frictionloss="{stage.coulomb}"
        solreffriction="{2.0 * step} 1" solimpfriction="0.9999 0.9999 0.001"/></body></worldbody>
      <actuator>
      <general name="axis" joint="axis" gainprm="{stiff}" biastype="affine" biasprm="0 {-stiff} {-VELOCITY_GAIN}"/></actuator>
      <sensor><jointpos name="position" joint="axis"/><actuatorfrc name="force" actuator="axis"/></sensor></mujoco>"""


def _moved(seconds: float, effects: tuple[str, ...]) -> Recording:
    """The true stage, simulated by MuJoCo along an exciting motion, as its drive would record it."""
    path = _repeated(plan(Question("axis", effects, ""), {"axis": LIMITS}, SAMPLE).paths["axis"], seconds)
    model = mujoco.MjModel.from_xml_string(_mjcf(TRUE, STEP))
    data = mujoco.MjData(model)
    data.qpos[0] = path[0]
    every = round(SAMPLE / STEP)
    ticks = np.arange(len(path) * every) / every
    control = np.interp(ticks, np.arange(len(path)), _control(path))[:, None]
    _, sensors = rollout.rollout(model, data, sysid.create_initial_state(model, data.qpos, data.qvel, data.act), control)
    position, force = (np.asarray(column) for column in sensors[0, ::every].T)
    columns = {
        "torque": force + NOISE * np.random.default_rng(0).standard_normal(len(path)),
        "position": np.round(position / QUANTUM) * QUANTUM,
        "position_demand": path,
    }
    info = RecordingInfo(machine="stage", sample_period=SAMPLE, axes={"axis": AxisInfo(joint="axis", actuator="axis")})
    return Recording("moved", info, np.arange(len(path)) * SAMPLE, {"axis": columns})


def _repeated(path: Array, seconds: float) -> Array:
    """A motion and its way back, until the time is over."""
    there_and_back = np.concatenate([path, path[::-1]])
    count = round(seconds / SAMPLE)
    return np.resize(there_and_back, count)


def _control(path: Array) -> Array:
    return np.asarray(path + np.gradient(path, SAMPLE) / POSITION_GAIN)


def _by_diagnosis(model: Path, recording: Recording) -> Stage:
    """The diagnosis's way to the parameters of a model: filter, inverse dynamics, regression with priors."""
    settings = Settings(cutoff_hz=CUTOFF)
    ready = prepared(model, [recording], [recording], settings)
    bench = bench_of(ready.rows, settings, ready.absolute)
    fit = state_of(bench, (), bench.white, {}).plain.fit()
    off = dict.fromkeys(("coulomb", "viscous", "inertia"), 0.0)
    for nominal, amount in zip(bench.nominals, fit.coefficients, strict=True):
        if nominal.effect is not None:
            off[nominal.effect] += float(amount)
        elif nominal.body is not None:
            off["inertia"] += float(amount) * NOMINAL.mass
    return Stage(NOMINAL.coulomb + off["coulomb"], NOMINAL.viscous + off["viscous"], NOMINAL.mass + off["inertia"])


def _by_sysid(model: Path, recording: Recording, iterations: int) -> Stage:
    """mujoco.sysid's way: closed-loop simulations until position and force agree, by its own optimiser."""
    columns = recording.columns["axis"]
    spec = mujoco.MjSpec.from_file(str(model))
    compiled = spec.compile()
    data = mujoco.MjData(compiled)
    data.qpos[0] = columns["position"][0]
    parameters = sysid.ParameterDict()
    for name, nominal, write in (
        ("coulomb", NOMINAL.coulomb, _set_coulomb),
        ("viscous", NOMINAL.viscous, _set_viscous),
        ("mass", NOMINAL.mass, _set_mass),
    ):
        parameters.add(sysid.Parameter(name, nominal, 0.1 * nominal, 3.0 * nominal, modifier=write))
    measured = sysid.TimeSeries.from_names(recording.time, np.column_stack([columns["position"], columns["torque"]]), compiled)
    sequences = sysid.ModelSequences(
        "stage",
        spec,
        recording.name,
        sysid.create_initial_state(compiled, data.qpos, data.qvel, data.act),
        sysid.TimeSeries(recording.time, _control(columns["position_demand"])[:, None]),
        measured,
    )
    with open(os.devnull, "w", encoding="utf-8") as nowhere, contextlib.redirect_stdout(nowhere):
        residual = sysid.build_residual_fn(models_sequences=[sequences])
        found, _ = sysid.optimize(parameters, residual, verbose=False, max_iters=iterations)
    return Stage(*(float(found[name].value[0]) for name in ("coulomb", "viscous", "mass")))


def _set_coulomb(spec: mujoco.MjSpec, parameter: sysid.Parameter) -> None:
    spec.joint("axis").frictionloss = parameter.value[0]


def _set_viscous(spec: mujoco.MjSpec, parameter: sysid.Parameter) -> None:
    spec.joint("axis").damping[0] = parameter.value[0]


def _set_mass(spec: mujoco.MjSpec, parameter: sysid.Parameter) -> None:
    spec.body("carriage").mass = parameter.value[0]


def _error(model: Path, stage: Stage, recording: Recording) -> float:
    """Rms over samples in motion of measured less predicted force, both filtered, with these parameters."""
    fitted = model.with_name("fitted.xml")
    fitted.write_text(_mjcf(stage, SAMPLE), encoding="utf-8")
    own = prepared(fitted, [recording], [recording], Settings(cutoff_hz=CUTOFF)).runs[0].axes["axis"]
    return float(np.sqrt(np.mean((own.torque - own.base)[own.used] ** 2)))


def _diagnosed(model: Path, recording: Recording) -> None:
    diagnose(model, [recording], [], Settings(), lambda _what, _share: None)


@dataclass(frozen=True)
class Phase:
    """A stretch of a diagnosis, by what it said when it began, and its seconds."""

    name: str
    seconds: float


def five_minutes() -> list[Phase]:
    """The phases of a diagnosis of three axes over five minutes at 1 kHz, recorded over the bus."""
    recording = _scara_moved(60.0 * MINUTES)
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / "scara.xml"
        model.write_text(_nominal_scara(), encoding="utf-8")
        told: list[tuple[str, float]] = [("reading the model", time.perf_counter())]
        diagnose(model, [recording], [], Settings(), lambda what, _share: told.append((what, time.perf_counter())))
        told.append(("", time.perf_counter()))
    return [Phase(name, after - began) for (name, began), (_, after) in pairwise(told)]


def phases_table(phases: Sequence[Phase]) -> Table:
    """Each phase and their sum."""
    table = Table(f"{MINUTES:.0f} minutes of three axes at 1 kHz", "seconds")
    for phase in phases:
        table.add_row(phase.name, f"{phase.seconds:.2f}")
    table.add_row("together (promised: less than 20 on two cores)", f"{sum(phase.seconds for phase in phases):.2f}")
    return table


def _nominal_scara() -> str:
    """The SCARA as its maker knows it: rotors, Coulomb and viscous friction in the joints; the other effects are the gap."""
    virtual = load_virtual_machine("scara")
    spec = mujoco.MjSpec.from_file(str(virtual.model_path))
    effects = read_effects(virtual.effects_path)
    for name, axis in virtual.axes.items():
        joint = spec.joint(axis.joint)
        joint.armature += axis.motor.inertia * axis.gear_ratio**2
        own = {one.effect.name: one.effect for one in effects if one.axis == name}
        joint.frictionloss = getattr(own["coulomb"], "coulomb")  # noqa: B009
        joint.damping[0] = getattr(own["viscous"], "viscous")  # noqa: B009
    spec.compile()
    return str(spec.to_xml())


def _scara_moved(seconds: float) -> Recording:
    """The virtual SCARA, its true effects in it, moved over the bus, all axes at once."""
    virtual, profile, known = load_virtual_machine("scara"), load_profile("servoone"), load_machine("scara")

    def connect_machine(transmit: Callable[[can.Message], None]) -> VirtualMachine:
        machine = VirtualMachine(virtual, profile, read_effects(virtual.effects_path), SyncClock(), 0, transmit)
        machine.power_on()
        return machine

    paths = {}
    for name, axis in known.axes.items():
        edge = 0.1 * (axis.travel[1] - axis.travel[0])
        most = MotionLimits(0.8 * axis.max_speed, 0.6 * axis.max_acceleration, 12.0 * axis.max_acceleration)
        limits = AxisLimits((axis.travel[0] + edge, axis.travel[1] - edge), most)
        path = plan(Question(name, ("stribeck", "viscous", "spring", "inertia"), ""), {name: limits}, SAMPLE).paths[name]
        paths[name] = _repeated(path, seconds)
    bus = InprocBus(connect_machine)
    with session_on(bus, known, profile, Lockstep(), None, Progress(), Path(os.devnull)) as session:
        session.go_to({name: float(path[0]) for name, path in paths.items()})
        return session.capture("five_minutes", paths)
