"""Every kind of file that the product reads from strangers: a sound one, and who reads it."""

from __future__ import annotations

import json
import shutil
import signal
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random
from types import FrameType

import can
import numpy as np
import yaml
from scipy.io import savemat

from drivetwin.controller.friction_table import friction_table
from drivetwin.controller.machine import load_machine
from drivetwin.controller.tasks.file import read_order
from drivetwin.drive_profiles import load_profile
from drivetwin.drive_profiles.eds_profile import profile_from_eds
from drivetwin.drive_profiles.eds_writer import eds_text
from drivetwin.drive_profiles.modbus_map import load_modbus_map_from
from drivetwin.drive_profiles.profile import load_profile_from, profile_folders
from drivetwin.drive_profiles.snapshot import Reading, Snapshot, read_snapshot, write_snapshot
from drivetwin.emulator.clock import SyncClock
from drivetwin.emulator.effects.file import read_effects
from drivetwin.emulator.machine import load_machine as load_plant
from drivetwin.emulator.snapshot import load_snapshot
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.errors import LONGEST, UserError
from drivetwin.foundation.text_files import parse_yaml
from drivetwin.hil_tests.bench import read_bench
from drivetwin.identification.read import read_friction
from drivetwin.recording.import_map import read_map
from drivetwin.recording.importer import import_recording
from drivetwin.recording.reader import read_recording
from drivetwin.recording.recording import AxisInfo, DriveLoops, Recording, RecordingInfo
from drivetwin.recording.writer import write_into
from drivetwin.twin.new_machine import new_machine
from fuzzing.spoiled import spoiled

PATIENCE = 60.0
"""Wall-clock seconds after which a file counts as a hang."""

BENCH = Path(__file__).parents[2] / "hil_tests" / "benches" / "scara.yaml"

_TIME = np.asarray(np.arange(200) * 1e-3, dtype=np.float64)


class BrokenError(Exception):
    """A file ended neither in a value nor in one line."""


@dataclass(frozen=True)
class Kind:
    """`write` puts a sound file and all that it needs into a folder; `read` reads it where it lies, called `name`.

    `slow`: in a child process, or with an optimisation to follow.
    """

    name: str
    text: bool
    write: Callable[[Path], None]
    read: Callable[[Path], object]
    slow: bool = False


def try_spoiled(kind: Kind, folder: Path, sound: bytes, dice: Random) -> str:
    """Spoil the sound file and read it: "read" or "refused". Raises BrokenError; the spoiled file is left in `folder`."""
    file = folder / kind.name
    file.write_bytes(spoiled(sound, dice, text=kind.text))
    try:
        with watched():
            kind.read(file)
    except UserError as error:
        message = str(error)
        if not message.isprintable() or len(message) > LONGEST + 500:
            raise BrokenError(f"{len(message)} characters: {message[:200]!r}") from None
        return "refused"
    except BrokenError:
        raise
    except Exception as error:
        raise BrokenError(f"{type(error).__name__}: {str(error)[:200]}") from error
    return "read"


@contextmanager
def watched() -> Iterator[None]:
    """Raise BrokenError out of a reader that does not end."""

    def hang(_number: int, _frame: FrameType | None) -> None:
        raise BrokenError(f"it did not end within {PATIENCE:g} s")

    former = signal.signal(signal.SIGALRM, hang)
    signal.setitimer(signal.ITIMER_REAL, PATIENCE)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, former)


# -- recordings --------------------------------------------------------------------------------------------------------


def _recording(folder: Path) -> None:
    axis = AxisInfo(joint="x", rated_torque=2.0, gear_ratio=50.0, drive=DriveLoops(position_gain=20.0, velocity_gain=3.0))
    info = RecordingInfo(machine="bench", sample_period=1e-3, start_time=12.0, derived=["x.velocity"], axes={"x": axis})
    write_into(Recording("run", info, _TIME, {"x": {"torque": np.asarray(np.sin(_TIME)), "position": _TIME}}), folder)


def _recording_with_csv(folder: Path) -> None:
    _recording(folder)
    (folder / "signals.parquet").unlink()
    rows = [f"{time:.3f},{np.sin(time):.6f},{time:.6f}" for time in _TIME]
    (folder / "signals.csv").write_text("\n".join(["time,x.torque,x.position", *rows]) + "\n")


# -- imports -----------------------------------------------------------------------------------------------------------

_MAP = """\
machine: bench
time: {column: t, unit: ms}
csv: {delimiter: ";", decimal: ",", header_row: 1, first_row: 3}
about: {who: nobody}
axes:
  x:
    joint_type: hinge
    gear_ratio: 50
    motor_rated_torque: 9.84 mN·m
    drive: {position_gain: 20.0, integral_time: null}
    columns:
      torque: {column: M, unit: "%", side: motor}
      velocity: {column: n, unit: rpm, scale: 2.0, optional: false}
"""
_BUS_MAP = """\
machine: bench
bus: {eds: drive.eds}
axes:
  x:
    node: 1
    rated_torque: 20
    encoder_increments: 4096
    gear_ratio: 50
    columns:
      position: {object: 0x6064, unit: inc}
      torque: {object: 0x6077, unit: permille}
"""
_TPDO_EDS = "[FileInfo]\nFileName=drive.eds\n" + "".join(
    f"[{section}]\nParameterName=x\nDataType={type_}\nAccessType=rw\nPDOMapping=1\nDefaultValue={value}\n"
    for section, type_, value in (
        *(("1006", 7, 1000), ("6064", 4, 0), ("6077", 3, 0)),
        *(("1800sub1", 7, "$NODEID+0x180"), ("1800sub2", 5, 1)),
        *(("1A00sub0", 5, 2), ("1A00sub1", 7, "0x60640020"), ("1A00sub2", 7, "0x60770010")),
    )
)
_PLAIN_MAP = _MAP.replace('csv: {delimiter: ";", decimal: ",", header_row: 1, first_row: 3}\n', "")


def _table(folder: Path) -> None:
    rows = [f"{number};{0.1 * number:.3f};{number}".replace(".", ",") for number in range(60)]
    (folder / "scope.csv").write_text("\n".join(["t;M;n", "ms;%;rpm", *rows]) + "\n")
    (folder / "map.yaml").write_text(_MAP)


def _matlab(folder: Path, *, compressed: bool = False) -> None:
    numbers = np.arange(60.0)
    content = {"t": numbers, "M": np.sin(numbers), "n": numbers, "s": {"a": numbers, "b": "x"}}
    savemat(folder / "run.mat", content, do_compression=compressed)
    (folder / "map.yaml").write_text(_PLAIN_MAP)


def _eds(folder: Path) -> None:
    (folder / "drive.eds").write_text(eds_text(load_profile("cia402-full"), "drive.eds"), encoding="ascii")


def _log(name: str) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        (folder / "drive.eds").write_text(_TPDO_EDS)
        (folder / "map.yaml").write_text(_BUS_MAP)
        with can.Logger(str(folder / name)) as logger:
            for cycle in range(60):
                logger(_frame(cycle, 0x80, b""))
                logger(_frame(cycle, 0x181, struct.pack("<ih", 10 * cycle, cycle)))

    return write


def _frame(cycle: int, identifier: int, data: bytes) -> can.Message:
    time = 1_600_000_000.0 + cycle * 1e-3 + identifier * 1e-7
    return can.Message(timestamp=time, arbitration_id=identifier, data=data, is_extended_id=False, channel=0)


def _import(file: Path) -> object:
    return import_recording(file, read_map(file.parent / "map.yaml"))


# -- drives and identification -----------------------------------------------------------------------------------------


def _identified(folder: Path) -> None:
    values = {"coulomb": 1.9, "viscous": 1.15, "offset": 0.1, "static_torque": 2.4, "stribeck_velocity": 0.05}
    values |= {"coulomb_positive": 1.8, "coulomb_negative": 2.0, "viscous_positive": 1.1, "viscous_negative": 1.2}
    told = {name: {"value": value, "unit": "N·m"} for name, value in values.items()}
    stribeck = {"joint": "rotate", "parameters": told, "direction": {"real": True}}
    plain = {"joint": "lift", "parameters": {name: told[name] for name in ("coulomb", "viscous")}}
    axes = {"rotate": stribeck, "lift": plain}
    payload = {"schema": "identified/1", "machine": "scara", "axes": axes, "settings": {"stribeck_exponent": 2.0}}
    (folder / "identified.json").write_text(json.dumps(payload, indent=1))


def _friction(file: Path) -> object:
    found, machine = read_friction(file), load_machine("scara")
    return [friction_table(law, machine.axes[name]) for name, law in found.laws.items() if name in machine.axes]


def _virtual() -> VirtualMachine:
    return VirtualMachine(load_plant("stage"), load_profile("cia402-full"), (), SyncClock(), 0, lambda _: None)


def _snapshot(folder: Path) -> None:
    """All that a drive stores, as `drivetwin snapshot` would have read it."""
    drive = _virtual().drives[0]
    found = [drive.dictionary[entry.index, entry.subindex] for entry in drive.profile.objects]
    readings = [
        Reading(one.index, one.subindex, one.name, one.data_type.name, one.access.value, one.encode(), None, None)
        for one in found
        if one.on_read is None
    ]
    write_snapshot(folder / "snapshot.json", Snapshot("cia402-full", drive.device.node_id, tuple(readings)), [])


def _load(file: Path) -> object:
    virtual = _virtual()
    load_snapshot(virtual.drives, read_snapshot(file), file)
    virtual.power_on()
    return virtual


def _effects(folder: Path) -> None:
    given = {"static_torque": {"value": 1.3, "unit": "N·m"}, "stribeck_velocity": {"value": 0.05, "unit": "rad/s"}}
    effect = {"effect": "stribeck", "axis": "rotate", "parameters": given}
    (folder / "effects.json").write_text(json.dumps({"schema": "effects/1", "effects": [effect]}, ensure_ascii=False))


# -- machines, drive types and benches of one's own --------------------------------------------------------------------


def _model(folder: Path) -> None:
    shutil.copy(load_machine("scara").model_path, folder / "model.xml")


def _drive_type(folder: Path) -> None:
    shutil.copytree(profile_folders()["cia402-full"], folder, dirs_exist_ok=True)


def _bench(folder: Path) -> None:
    shutil.copy(BENCH, folder / "bench.yaml")


def _task(folder: Path) -> None:
    parameters = {"dwell": 0.3, "moves": [{"axis": "lift", "to": 0.1}]}
    head = {"format": "task/1", "task": "move", "machine": "scara", "profile": "servoone"}
    (folder / "task.json").write_text(json.dumps({**head, "cycle": 0.001, "seed": 0, "parameters": parameters}))


def _any_yaml(file: Path) -> object:
    """Any YAML at all, without what the map makes of it."""
    try:
        return parse_yaml(file.read_text(encoding="utf-8", errors="replace"))
    except yaml.YAMLError as error:
        raise UserError(str(error)) from None


KINDS: dict[str, Kind] = {
    "recording.json": Kind("recording.json", True, _recording, lambda file: read_recording(file.parent, allow_gaps=True)),
    "parquet": Kind("signals.parquet", False, _recording, lambda file: read_recording(file.parent)),
    "signals.csv": Kind("signals.csv", True, _recording_with_csv, lambda file: read_recording(file.parent, allow_gaps=True)),
    "map": Kind("map.yaml", True, _table, lambda file: import_recording(file.parent / "scope.csv", read_map(file))),
    "csv": Kind("scope.csv", True, _table, _import),
    "yaml": Kind("map.yaml", True, _table, _any_yaml),
    "mat": Kind("run.mat", False, _matlab, _import, slow=True),
    "mat compressed": Kind("run.mat", False, lambda folder: _matlab(folder, compressed=True), _import, slow=True),
    **{log: Kind(f"bus.{log}", log != "blf", _log(f"bus.{log}"), _import, True) for log in ("blf", "asc", "log", "trc")},
    "eds": Kind("drive.eds", True, _eds, lambda file: profile_from_eds(file, load_profile("cia402-full"))),
    "identified.json": Kind("identified.json", True, _identified, _friction, slow=True),
    "snapshot.json": Kind("snapshot.json", True, _snapshot, _load),
    "effects.json": Kind("effects.json", True, _effects, read_effects),
    "model.xml": Kind("model.xml", True, _model, lambda file: new_machine(file, None, 20.0), slow=True),
    # Beside what is kept of a folder that has been read.
    "profile.yaml": Kind("profile.yaml", True, _drive_type, lambda file: load_profile_from.__wrapped__(file.parent)),
    "objects.csv": Kind("objects.csv", True, _drive_type, lambda file: load_profile_from.__wrapped__(file.parent)),
    "modbus.yaml": Kind("modbus.yaml", True, _drive_type, lambda file: load_modbus_map_from.__wrapped__(file.parent)),
    "bench.yaml": Kind("bench.yaml", True, _bench, read_bench),
    "task.json": Kind("task.json", True, _task, read_order),
}
