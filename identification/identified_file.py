"""identified.json (identified/1) as `identify` and `fit` write it: the one typed form in which it is read back."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Literal, Self

from pydantic import BaseModel, Field, model_validator

from drivetwin.foundation.typed_json import read_json
from drivetwin.identification.friction_law import FrictionLaw

LARGEST = 1e9
"""Of any value, in SI units: no machine has more."""
EXPONENTS = (0.1, 10.0)
DIRECTIONAL = ("coulomb_positive", "coulomb_negative", "viscous_positive", "viscous_negative")
"""Parameters of the direction-dependent fit."""
STRIBECK = ("static_torque", "stribeck_velocity")
"""Parameters without which there is no Stribeck term."""


class Value(BaseModel):
    """One parameter, joint side; `ci90`: its 90 % interval."""

    value: float = Field(ge=-LARGEST, le=LARGEST)
    unit: str
    ci90: tuple[float, float] | None = None

    @model_validator(mode="after")
    def _is_within_its_interval(self) -> Self:
        if self.ci90 is not None and not self.ci90[0] <= self.value <= self.ci90[1]:
            raise ValueError(f"value is {self.value:g}, outside of its ci90, {self.ci90[0]:g} to {self.ci90[1]:g}")
        return self


class Verdict(BaseModel):
    """Whether a test says that what it is of is real."""

    real: bool = False


class Axis(BaseModel):
    """Parameters of an axis by name; `direction`: whether its friction depends on the direction."""

    joint: str
    parameters: dict[str, Value]
    direction: Verdict = Verdict()


class Settings(BaseModel):
    """Of the fit; `stribeck_exponent`: of an axis for which none was fitted."""

    stribeck_exponent: float = Field(default=FrictionLaw.stribeck_exponent, ge=EXPONENTS[0], le=EXPONENTS[1])


class Identified(BaseModel):
    """The whole file."""

    format: Literal["identified/1"] = Field(alias="schema")
    machine: str
    axes: dict[str, Axis]
    settings: Settings = Settings()

    @property
    def joints(self) -> dict[str, str]:
        """Joint of each axis."""
        return {name: axis.joint for name, axis in self.axes.items()}

    def on(self, joints: Mapping[str, str]) -> Identified:
        """The same on other joints, by axis."""
        axes = {name: axis.model_copy(update={"joint": joints[name]}) for name, axis in self.axes.items()}
        return self.model_copy(update={"axes": axes})


def read_identified(path: Path) -> Identified:
    """Raises UserError naming the file and the key that is missing or wrong."""
    return read_json(Identified, path, "identified/1", "`drivetwin identify` and `drivetwin fit` write identified.json")
