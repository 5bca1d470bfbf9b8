"""Effects of any parameters, written as effects/1 and read back, are the same to the bit."""

from __future__ import annotations

from pathlib import Path

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivetwin.emulator.effects import Effect, Parameter, PlacedEffect, library, read_effects
from drivetwin.emulator.effects.file import effects_payload
from drivetwin.foundation.files import write_json


def value(parameter: Parameter) -> st.SearchStrategy[float]:
    """Any within its bounds, which JSON can hold."""
    return st.floats(max(parameter.low, -1e300), min(parameter.high, 1e300))


def effect(kind: type[Effect]) -> st.SearchStrategy[Effect]:
    return st.builds(kind, **{parameter.name: value(parameter) for parameter in kind.parameters})


UNITS = st.sampled_from(["N·m", "rad", "1", "N·m·s/rad"])
AXES = st.text(min_size=1, max_size=8).filter(lambda name: name.isprintable())


@st.composite
def placed(draw: st.DrawFn) -> PlacedEffect:
    kind = draw(st.sampled_from(sorted(library().values(), key=lambda each: each.name)))
    units = {parameter.name: draw(UNITS) for parameter in kind.parameters}
    return PlacedEffect(draw(AXES), draw(effect(kind)), units)


@settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(effects=st.lists(placed(), max_size=6, unique_by=lambda each: (each.effect.name, each.axis)))
def test_effects_come_back_as_they_were(tmp_path: Path, effects: list[PlacedEffect]) -> None:
    write_json(tmp_path / "effects.json", effects_payload(effects))
    assert read_effects(tmp_path / "effects.json") == tuple(effects)
