"""Effects that are not the product's: from files and from installed packages, and what is refused of them."""

from __future__ import annotations

import sys
from math import exp
from pathlib import Path

import pytest
from effect_bench import WHOLE, effect, hinge

from drivetwin.emulator.effects import add_effects, added_effects, library, read_effect_file
from drivetwin.foundation.errors import UserError

EFFECT = '''
from dataclasses import dataclass
from typing import ClassVar

from drivetwin.emulator.effects.base import TORQUE, Parameter, Start, TorqueEffect


@dataclass(frozen=True)
class Drag(TorqueEffect):
    """A drag."""

    name: ClassVar = "drag"
    family: ClassVar = "friction"
    parameters: ClassVar = (Parameter("level", TORQUE),)

    level: float

    def resistance(self, position, velocity, time):
        return self.level * velocity

    @classmethod
    def starts(cls, motion, axis):
        return [Start((cls(1.0),), lambda found: cls(found[0]))]
'''


pytestmark = pytest.mark.usefixtures("library_as_it_was")


def added(folder: Path, text: str, name: str = "own.py") -> None:
    (folder / name).write_text(text, encoding="utf-8")
    add_effects([read_effect_file(folder / name)])


def test_a_file_adds_its_effects_behind_those_of_the_library(tmp_path: Path) -> None:
    before = list(library())
    added(tmp_path, EFFECT)
    assert list(library()) == [*before, "drag"]
    assert effect("drag", level=2.0) == effect("drag", level=2.0)


def test_a_torque_by_one_equation_acts_in_the_plant(tmp_path: Path) -> None:
    """A drag of 0.6 N·m·s/rad on 0.25 kg·m² lets the speed fall as exp(-t 0.6 / 0.25)."""
    added(tmp_path, EFFECT)
    rig = hinge(effect("drag", level=0.6))
    rig.start(velocity=2.0)
    rig.run(0.5)
    assert rig.velocity == pytest.approx(2.0 * exp(-0.5 * 0.6 / WHOLE), rel=1e-3)


def test_a_file_that_is_there_already_changes_nothing(tmp_path: Path) -> None:
    added(tmp_path, EFFECT)
    kind = library()["drag"]
    added(tmp_path, EFFECT)
    assert library()["drag"] is kind
    assert len(added_effects()) == 1


def test_helpers_and_bases_of_a_file_are_no_effects(tmp_path: Path) -> None:
    base = "class Base(TorqueEffect): ...\n\n\n@dataclass(frozen=True)\nclass Drag(Base)"
    added(tmp_path, EFFECT.replace("class Drag(TorqueEffect)", base))
    assert "drag" in library()


REFUSED = {
    "does not parse": ("def", r"own.py:1: SyntaxError: "),
    "fails": (f"{EFFECT}1 / 0\n", f"own.py:{EFFECT.count(chr(10)) + 1}: ZeroDivisionError: division by zero"),
    "imports what is not there": ("import nonesuch\n", r"own.py:1: ModuleNotFoundError: No module named 'nonesuch'"),
    "no effect": ("x = 1\n", "own.py: holds no effect; expected a subclass of drivetwin.*effects.base.Effect with a `name`"),
    "a name that is taken": (
        EFFECT.replace('"drag"', '"coulomb"'),
        "own.py: effect 'coulomb' is in the library already, by drivetwin.emulator.effects.coulomb: rename one",
    ),
    "lacks a method": (EFFECT.replace("def resistance", "def resist"), "own.py: Drag: lacks resistance; docs/effects.md says"),
    "lacks what its kind asks": (
        EFFECT.replace("TorqueEffect", "ModelEffect").replace("def starts", "def add_to(self): ...\n\n    def drawn"),
        "own.py: Drag: lacks probe, shapes; docs",
    ),
    "lacks parameters": (EFFECT.replace("    parameters: ClassVar = ", "    others = "), "own.py: Drag: lacks parameters"),
    "of no family": (
        EFFECT.replace('"friction"', '"magic"'),
        "own.py: Drag: family is 'magic'; expected one of friction, rigid body, motor and drive, transmission, sensing",
    ),
    "parameters that are none": (
        EFFECT.replace('(Parameter("level", TORQUE),)', '("level",)'),
        r"own.py: Drag: parameters: expected a tuple of Parameter\(name, unit",
    ),
    "parameters that are not its fields": (
        EFFECT.replace("    level: float", "    level: float\n    more: float = 0.0"),
        r"own.py: Drag: parameters: level; expected a @dataclass\(frozen=True\) with just these fields",
    ),
}


@pytest.mark.parametrize("why", REFUSED)
def test_a_file_is_refused_in_one_line_and_the_library_stays(tmp_path: Path, why: str) -> None:
    text, message = REFUSED[why]
    before = list(library())
    with pytest.raises(UserError, match=message) as refusal:
        added(tmp_path, text)
    assert str(refusal.value).startswith(str(tmp_path))
    assert list(library()) == before


def test_no_file(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"no file .*own.py; --effects-from takes a Python file that holds effects"):
        read_effect_file(tmp_path / "own.py")


def test_two_files_with_one_name(tmp_path: Path) -> None:
    added(tmp_path, EFFECT)
    with pytest.raises(UserError, match=r"other.py: effect 'drag' is in the library already, by .*own.py"):
        added(tmp_path, EFFECT, "other.py")


def installed(site: Path, monkeypatch: pytest.MonkeyPatch, target: str, text: str = EFFECT) -> None:
    """A package of a stranger's, as an installer leaves it."""
    (site / "strangers_drag.py").write_text(text, encoding="utf-8")
    about = site / "strangers_drag-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: strangers_drag\nVersion: 1.0\n", encoding="utf-8")
    (about / "entry_points.txt").write_text(f"[drivetwin.effects]\ndrag = {target}\n", encoding="utf-8")
    monkeypatch.syspath_prepend(str(site))
    monkeypatch.delitem(sys.modules, "strangers_drag", raising=False)
    library.cache_clear()


@pytest.mark.parametrize("target", ["strangers_drag", "strangers_drag:Drag"])
def test_an_installed_package_has_its_effects_in_the_library(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, target: str
) -> None:
    installed(tmp_path, monkeypatch, target)
    assert library()["drag"].__module__ == "strangers_drag"


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ("strangers_drag:Nothing", r"drag = strangers_drag:Nothing \(drivetwin.effects\) does not import: AttributeError"),
        ("strangers_drag:TORQUE", "expected a module or a subclass of drivetwin.emulator.effects.base.Effect, got Unit"),
        ("dataclasses", "entry point drag = dataclasses .*: holds no effect"),
    ],
)
def test_an_installed_package_is_refused_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, target: str, message: str
) -> None:
    installed(tmp_path, monkeypatch, target)
    with pytest.raises(UserError, match=message):
        library()
