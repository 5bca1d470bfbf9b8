"""The friction that the controller identified is the plant's true friction."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from drivetwin.foundation.text_files import parse_json
from drivetwin.hil_tests.evidence import Evidence
from drivetwin.hil_tests.expectations.base import MET, Expectation, Finding, limit

FILE = "identified.json"

_OTHERWISE_NAMED = {"stribeck_exponent": "exponent"}
"""Parameters of identified/1 that a plant's truth names otherwise."""


@dataclass(frozen=True)
class Identification(Expectation):
    """|identified - true| / |true| of each of `parameters` on each axis that has one, at most `within` (identified/1).

    A parameter that no axis truly has cannot be judged, and is not met.
    """

    name: ClassVar[str] = "identification"
    needs_truth: ClassVar[bool] = True

    within: float = field(metadata=limit("identification_error"))
    parameters: tuple[str, ...] = ("coulomb", "viscous")

    def judge(self, evidence: Evidence) -> Finding:
        said = None if evidence.out is None else read_json(evidence.out / FILE)
        axes = said.get("axes") if isinstance(said, dict) else None
        if not isinstance(axes, dict):
            return self.fails(f"the controller wrote no {FILE} (identified/1)", None, evidence.end)
        finding = self._knowable(evidence)
        for axis in evidence.axes:
            for name in self.parameters:
                true = evidence.friction[axis].get(_true_name(name), 0.0)
                if true == 0.0:
                    continue
                error = abs(_value(axes, axis, name) - true) / abs(true)
                if np.isnan(error):
                    finding += self.fails(f"{FILE} says no {name}", axis, evidence.end)
                    continue
                message = f"the identified {name} is not the plant's"
                finding += self.at_most(f"error of {name}", error, self.within, "1", message, axis, evidence.end)
        return finding

    def _knowable(self, evidence: Evidence) -> Finding:
        """Whether the truth of an axis has each of the parameters."""
        finding, known = MET, {name for told in evidence.friction.values() for name in told}
        for name in self.parameters:
            if _true_name(name) not in known:
                there = ", ".join(sorted(known))
                said = f"the plant's truth has no {name} that the identified one could be held against; it has {there}"
                finding += self.fails(said, None, evidence.end)
        return finding


def _true_name(name: str) -> str:
    return _OTHERWISE_NAMED.get(name, name)


def read_json(path: Any) -> object:
    """The content of a JSON file, None where there is none."""
    try:
        content: object = parse_json(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return content


def _value(axes: dict[str, Any], axis: str, name: str) -> float:
    """What was identified; NaN where nothing was."""
    try:
        return float(axes[axis]["parameters"][name]["value"])
    except (KeyError, TypeError, ValueError):
        return float("nan")
