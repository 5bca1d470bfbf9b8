"""Plug-ins of every kind are found in one way: a file of the product's folder, or an entry point of an installed package."""

from __future__ import annotations

import importlib
import shutil
import struct
import sys
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from drivetwin.drive_profiles.profile import PROFILES, available_profiles, load_profile, profile_folders
from drivetwin.emulator.drive.modes import modes
from drivetwin.emulator.effects import library as effects
from drivetwin.emulator.faults.library import library as faults
from drivetwin.foundation.errors import UserError
from drivetwin.hil_tests.expectations.library import library as expectations
from drivetwin.mutants.library import mutant, mutant_file, mutant_names
from drivetwin.recording.formats.library import formats
from drivetwin.recording.import_map import ImportMap
from drivetwin.recording.importer import import_recording

FAULT = '''
from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.faults.base import Fault
from drivetwin.emulator.faults.parameter import NODE


@dataclass(frozen=True)
class Smoke(Fault):
    name: ClassVar[str] = "smoke"
    parameters: ClassVar = (NODE,)

    def befall(self, virtual, axis):
        return
'''

EXPECTATION = '''
from dataclasses import dataclass
from typing import ClassVar

from drivetwin.hil_tests.expectations.base import MET, Expectation


@dataclass(frozen=True)
class Smokeless(Expectation):
    name: ClassVar[str] = "smokeless"
    needs_truth: ClassVar[bool] = False

    def judge(self, evidence):
        return MET
'''

MODE = '''
from drivetwin.emulator.drive.profile_velocity import ProfileVelocity


class Jog(ProfileVelocity):
    code = -1
'''

MUTANT = '''"""It smokes."""

from drivetwin.mutants.base import CaughtBy

CAUGHT_BY = CaughtBy("01_boot.configured", "operational")


def break_controller():
    return
'''

FORMAT = '''
import struct

import numpy as np

from drivetwin.recording.formats.table_format import TableFormat
from drivetwin.recording.table import Column, Table


class Smoke(TableFormat):
    """Of an oscilloscope: three names of eight letters, then rows of three numbers."""

    name = "smoke"
    endings = (".smoke",)

    def table(self, file, import_map):
        raw = file.read_bytes()
        names = [raw[start : start + 8].decode().strip() for start in (0, 8, 16)]
        rows = np.array(list(struct.iter_unpack("<3d", raw[24:])))
        columns = [Column(name, None, values.copy) for name, values in zip(names, rows.T, strict=True)]
        return Table(file, tuple(columns))
'''

CODE_OF: dict[str, tuple[str, Callable[[], Mapping[Any, Any]], object]] = {
    "faults": (FAULT, faults, "smoke"),
    "expectations": (EXPECTATION, expectations, "smokeless"),
    "modes": (MODE, modes, -1),
    "formats": (FORMAT, formats, "smoke"),
}
"""A kind's module, its library, and the key of what the module adds."""


Install = Callable[[str, str, str], None]
"""Leaves a package `strangers` of that code, with an entry point of that group and target, as an installer does."""


@pytest.fixture
def install(tmp_path: Path) -> Iterator[Install]:
    """All of what it leaves goes with the test."""

    def clear() -> None:
        for library in (effects, faults, expectations, modes, formats, profile_folders):
            library.cache_clear()
        for name in [name for name in sys.modules if name.partition(".")[0] == "strangers"]:
            del sys.modules[name]
        importlib.invalidate_caches()

    def leave(code: str, group: str, target: str) -> None:
        (tmp_path / "strangers").mkdir()
        (tmp_path / "strangers" / "__init__.py").write_text(code, encoding="utf-8")
        about = tmp_path / "strangers-1.0.dist-info"
        about.mkdir()
        (about / "METADATA").write_text("Metadata-Version: 2.1\nName: strangers\nVersion: 1.0\n", encoding="utf-8")
        (about / "entry_points.txt").write_text(f"[drivetwin.{group}]\nsmoke = {target}\n", encoding="utf-8")
        clear()

    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(tmp_path))
        yield leave
    clear()


@pytest.mark.parametrize("group", CODE_OF)
@pytest.mark.parametrize("by", ["module", "class"])
def test_a_package_adds_to_a_library(install: Install, group: str, by: str) -> None:
    code, library, key = CODE_OF[group]
    before = set(library())
    name = code.partition("\nclass ")[2].partition("(")[0]
    install(code, group, "strangers" if by == "module" else f"strangers:{name}")
    assert set(library()) == before | {key}
    assert library()[key].__module__ == "strangers"


@pytest.mark.parametrize("group", CODE_OF)
@pytest.mark.parametrize(
    ("target", "message"),
    [
        ("nonesuch", r"entry point smoke = nonesuch \(drivetwin\.\w+\) does not import: ModuleNotFoundError"),
        ("dataclasses", r"entry point smoke = dataclasses .*: holds no \w+; expected a subclass of drivetwin"),
        ("dataclasses:MISSING", r"entry point smoke = .*: expected a module or a subclass of drivetwin\."),
    ],
)
def test_what_is_no_plug_in_is_refused_in_one_line(install: Install, group: str, target: str, message: str) -> None:
    _, library, _ = CODE_OF[group]
    install("", group, target)
    with pytest.raises(UserError, match=message):
        library()


def test_a_file_in_a_strangers_format_becomes_a_recording(install: Install, tmp_path: Path) -> None:
    """Milliseconds, degrees and N·m as the file has them, in SI by hand."""
    rows = [(float(time), 10.0 * time, 0.5 - time) for time in range(4)]
    file = tmp_path / "scope.SMOKE"
    file.write_bytes(b"t       angle   torque  " + b"".join(struct.pack("<3d", *row) for row in rows))
    columns = {"position": {"column": "angle", "unit": "deg"}, "torque": {"column": "torque", "unit": "N·m"}}
    asked = {"machine": "bench", "time": {"column": "t", "unit": "ms"}, "axes": {"x": {"columns": columns}}}
    with pytest.raises(UserError, match=r"what \.smoke holds is not known; say `format:` in the map, one of bus, csv, matlab"):
        import_recording(file, ImportMap.model_validate(asked))
    install(FORMAT, "formats", "strangers")
    recording = import_recording(file, ImportMap.model_validate(asked))
    assert recording.time == pytest.approx([0.0, 0.001, 0.002, 0.003])
    assert recording.columns["x"]["position"] == pytest.approx([0.0, 0.17453293, 0.34906585, 0.52359878])
    assert recording.columns["x"]["torque"] == pytest.approx([0.5, -0.5, -1.5, -2.5])


def test_an_ending_that_two_formats_have_is_asked_for(install: Install, tmp_path: Path) -> None:
    install(FORMAT.replace('".smoke"', '".dat"'), "formats", "strangers")
    (tmp_path / "x.dat").touch()
    asked = {"machine": "bench", "axes": {"x": {"columns": {"position": {"column": 1}, "torque": {"column": 2}}}}}
    with pytest.raises(UserError, match=r"x\.dat: \.dat may be csv, smoke; say one of them as `format:` in the map"):
        import_recording(tmp_path / "x.dat", ImportMap.model_validate(asked))
    with pytest.raises(UserError, match=r"format: 'excel' is unknown; there are bus, csv, matlab, twincat, smoke"):
        import_recording(tmp_path / "x.dat", ImportMap.model_validate(asked | {"format": "excel"}))


def test_endings_that_no_file_has(install: Install) -> None:
    install(FORMAT.replace('".smoke"', '"Smoke"'), "formats", "strangers")
    with pytest.raises(UserError, match=r"Smoke: endings: \('Smoke',\); expected a tuple of endings.*docs/import.md"):
        formats()


def test_a_name_that_is_taken(install: Install) -> None:
    install(FAULT.replace('"smoke"', '"sto"'), "faults", "strangers")
    with pytest.raises(UserError, match=r"'sto' is in the library already, by drivetwin\.emulator\.faults\.sto: rename one"):
        faults()


def test_a_class_that_lacks_a_method(install: Install) -> None:
    install(EXPECTATION.replace("def judge", "def see"), "expectations", "strangers")
    with pytest.raises(UserError, match=r"Smokeless: lacks judge; docs/acceptance.md"):
        expectations()


def test_a_fault_whose_parameters_are_not_its_fields(install: Install) -> None:
    install(FAULT.replace("    def befall", "    heat: float = 0.0\n\n    def befall"), "faults", "strangers")
    with pytest.raises(UserError, match="Smoke: parameters: node; expected its fields: node, heat"):
        faults()


def test_every_mode_of_the_standard_is_found() -> None:
    """CiA 402-2, 6060h: all but cyclic synchronous torque with commutation angle."""
    assert set(modes()) == {1, 2, 3, 4, 6, 7, 8, 9, 10}


def test_a_package_holds_a_mutant(install: Install, tmp_path: Path) -> None:
    install(MUTANT, "mutants", "strangers")
    assert "smoke" in mutant_names()
    assert mutant("smoke").breaks == "It smokes."
    assert mutant_file("smoke") == tmp_path / "strangers" / "__init__.py"


def test_a_package_holds_a_drive_type(install: Install, tmp_path: Path) -> None:
    install("", "profiles", "strangers")
    for name in ("profile.yaml", "objects.csv"):
        shutil.copy(PROFILES / "servoone" / name, tmp_path / "strangers")
    profile_folders.cache_clear()
    assert available_profiles() == ("cia402-full", "dryve_d1", "servoone", "strangers")
    assert load_profile("strangers").objects == load_profile("servoone").objects


def test_a_package_without_a_drive_type_is_refused(install: Install) -> None:
    install("", "profiles", "strangers")
    with pytest.raises(UserError, match=r"smoke = strangers .*: expected a package whose folder is a drive type"):
        available_profiles()
