"""The Python API: what the commands do, on values instead of files. Each function is imported from `drivetwin` itself."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import can

from drivetwin.bus.channel import InprocBus, is_physical, open_bus
from drivetwin.controller.machine import load_machine
from drivetwin.controller.pacing import PACINGS
from drivetwin.controller.procedure import FIT, capture_machine
from drivetwin.controller.progress import Progress
from drivetwin.diagnosis.diagnose import diagnose as diagnosed
from drivetwin.diagnosis.prepare.inputs import read_inputs
from drivetwin.diagnosis.report.closed_loop import in_closed_loop
from drivetwin.diagnosis.report.frequency_response import with_responses
from drivetwin.diagnosis.report.result import Diagnosis
from drivetwin.diagnosis.settings import Settings
from drivetwin.drive_profiles import load_profile
from drivetwin.emulator.clock import CLOCKS
from drivetwin.emulator.effects import read_effects
from drivetwin.emulator.machine import load_machine as load_virtual_machine
from drivetwin.emulator.plant import truth_path
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.scratch import scratch
from drivetwin.identification import Identification, load_model
from drivetwin.identification import identify as identified
from drivetwin.recording.import_map import read_map
from drivetwin.recording.importer import import_recording as imported
from drivetwin.recording.recording import Recording
from drivetwin.recording.writer import write_recording
from drivetwin.twin.apply import Applied
from drivetwin.twin.comparison import Comparison, compared
from drivetwin.twin.findings import apply_findings
from drivetwin.twin.recordings import read_for

PathLike = str | Path


@dataclass(frozen=True)
class Emulation:
    """Virtual drives that are powered on: `bus` is a python-can bus for any master, `machine` what its drives move."""

    bus: can.BusABC
    machine: VirtualMachine


@contextmanager
def emulate(
    machine: PathLike = "scara", *, profile: str = "servoone", truth: PathLike | None = None, clock: str = "sync", seed: int = 0
) -> Iterator[Emulation]:
    """A virtual machine in this thread, on a bus of its own, until the block ends.

    `machine`: a name, or the folder of one of your own. `truth`: its true effects (effects/1); None: the machine's. `clock`: by
    `sync` a SYNC on the bus advances it by one cycle, by `realtime` it follows the wall clock while the bus is read. `seed`: of
    the sensors' noise. Raises UserError for a machine, drive type, clock or file that there is not.
    """
    if clock not in CLOCKS:
        raise UserError(f"unknown clock {clock!r}; expected {' or '.join(CLOCKS)}")
    described, drive_type = load_virtual_machine(str(machine)), load_profile(profile)
    effects = read_effects(truth_path(described, None if truth is None else Path(truth)))
    made: list[VirtualMachine] = []

    def connect(transmit: Callable[[can.Message], None]) -> VirtualMachine:
        made.append(VirtualMachine(described, drive_type, effects, CLOCKS[clock](), seed, transmit))
        return made[0]

    bus = InprocBus(connect)
    try:
        made[0].power_on()
        yield Emulation(bus, made[0])
    finally:
        bus.shutdown()


def identify(
    machine: PathLike,
    bus: can.BusABC | str,
    *,
    profile: str = "servoone",
    clock: str = "sync",
    seed: int = 0,
    recordings: PathLike | None = None,
) -> Identification:
    """Friction, inertia and Stribeck curve of every axis: bring-up, homing, strokes and an excitation over `bus`, and a fit.

    `bus`: of `emulate`, or the name of one that `drivetwin emulate` offers; `clock`: the emulator's; `seed` of the excitation.
    `recordings`: a folder in which each recording becomes a folder of its own: `strokes_AXIS`, `excitation_AXIS`, and
    `validation_AXIS`, which is not fitted. A machine whose axes move in groups has the names of a group, joined by _.
    Every axis is without voltage afterwards. Raises UserError for whatever the bench has to set right, and for a bus that may
    be a real machine: `drivetwin identify` asks before it moves one.
    """
    if clock not in PACINGS:
        raise UserError(f"unknown clock {clock!r}; expected {' or '.join(PACINGS)}")
    if isinstance(bus, str) and is_physical(bus):
        raise UserError(f"{bus} may be a real machine: `drivetwin identify` asks for limits and a confirmation")
    known, drive_type = load_machine(str(machine)), load_profile(profile)
    joined = open_bus(bus) if isinstance(bus, str) else bus
    with scratch() as folder:
        log = folder / "bus.log"
        captured = capture_machine(joined, known, drive_type, PACINGS[clock](), None, seed, Progress(), log)
    if recordings is not None:
        for recording in (*captured.recordings, *captured.validation):
            folder = Path(recordings) / recording.name
            write_recording(recording, folder, seed=seed, inputs=[known.model_path, known.axes_path])
    return identified(load_model(known.model_path), captured.recordings, captured.validation, FIT)


def import_recording(file: PathLike, import_map: PathLike, *, repair: bool = False) -> Recording:
    """The recording in a foreign file, by a map of its columns (MAP.yaml, docs/import.md); SI units, joint side.

    `repair`: repeated rows, single missing samples and ends without numbers of a table are repaired. Raises UserError naming
    file, column and row.
    """
    return imported(Path(file), read_map(Path(import_map)), mend=repair)


def diagnose(
    model: PathLike,
    recordings: Sequence[PathLike],
    validation: Sequence[PathLike] = (),
    *,
    cutoff_hz: float | None = None,
    allow_gaps: bool = False,
    seed: int = 0,
) -> Diagnosis:
    """Where a simulation (MJCF) and a machine differ, which effects cause it, and how far the gap shrinks with them.

    `recordings`: folders, to be fitted; `validation`: folders that are not; without any, blocks are held back. `cutoff_hz` [Hz]
    of the filter, None: from the recordings. `seed`: of the draws for intervals and probabilities. Raises UserError for a model
    or a recording that does not fit.
    """
    fitted, held = ([Path(each) for each in paths] for paths in (recordings, validation))
    inputs = read_inputs(Path(model), fitted, held, cutoff_hz=cutoff_hz, allow_gaps=allow_gaps)
    settings = Settings(cutoff_hz=cutoff_hz, seed=seed)
    found = diagnosed(Path(model), inputs.training, inputs.validation, settings, lambda _what, _share: None)
    found = in_closed_loop(found, Path(model))
    return with_responses(found, [*inputs.training, *inputs.validation])


def apply(findings: PathLike, model: PathLike, *, joints: Mapping[str, str] | None = None) -> Applied:
    """What was identified or diagnosed (identified.json, effects.json), written into a model (MJCF), which stays as it is.

    `joints`: of axes whose name neither a joint nor its motor has. Raises UserError for a file of another kind, an axis without
    a joint, and a value that the model cannot have.
    """
    return apply_findings(Path(findings), Path(model), joints or {})


def replay(
    model: PathLike,
    recordings: Sequence[PathLike],
    *,
    effects: PathLike | None = None,
    cutoff_hz: float = 48.0,
    allow_gaps: bool = False,
) -> list[Comparison]:
    """A model moved in closed loop as a machine was moved, and how far apart they are; one comparison a recording.

    `recordings`: folders of recordings with a demand. `effects` (effects/1): the model is moved without and with them.
    `cutoff_hz` [Hz] of the zero-phase filter of what is compared. Raises UserError for what does not fit the model.
    """
    if not cutoff_hz > 0.0:
        raise UserError(f"cutoff_hz {cutoff_hz:g}: expected a frequency above 0 Hz")
    placed = None if effects is None else read_effects(Path(effects))
    read = read_for(Path(model), [Path(each) for each in recordings], cutoff_hz, allow_gaps=allow_gaps)
    return [compared(Path(model), recording, placed, cutoff_hz) for recording in read]
