"""What the recordings tell of an axis's mechanics over frequency: a curve with its resonances, or why there is none."""

from __future__ import annotations

from html import escape

from drivetwin.diagnosis.report.result import Diagnosis, FrequencyResponse, NoResponse
from drivetwin.diagnosis.report.wording import listed
from drivetwin.foundation.page_table import pictured
from drivetwin.identification.frequency.figures import mechanics_figure
from drivetwin.identification.frequency.resonances import Resonances
from drivetwin.identification.result import UNITS
from drivetwin.motion.inverse_dynamics import JointKind

_TITLE = "Frequency response, torque to velocity"


def frequency_part(name: str, diagnosis: Diagnosis) -> str:
    """For the section of an axis; empty where nobody has asked for it."""
    units = UNITS[JointKind.PRISMATIC if diagnosis.units[name] == "N" else JointKind.REVOLUTE]
    match diagnosis.responses.get(name):
        case FrequencyResponse() as found:
            figure = mechanics_figure(found, found.resonances, units)
            return f"{pictured(_TITLE, figure)}<p>{escape(_told(found))}</p>{_note(found)}"
        case NoResponse(reason):
            return f'<h3>{_TITLE}</h3><p class="note">These recordings do not show it: {escape(reason)}.</p>'
    return ""


def _told(found: FrequencyResponse) -> str:
    """What resonance and anti-resonance say of a motor and a load with a spring between them."""
    sure = found.frequency[found.sure]
    shapes, span = found.resonances, f"from {sure.min():.3g} to {sure.max():.3g} Hz"
    if not shapes.resonances and not shapes.antiresonances:
        return f"No resonance {span}: motor and load move as one there."
    told = f"{_counted('anti-resonance', shapes.antiresonances)}, {_counted('resonance', shapes.resonances)}, {span}"
    return f"{told[0].upper()}{told[1:]}: elastic between motor and load{_ratio(shapes)}."


def _counted(what: str, found: tuple[float, ...]) -> str:
    if not found:
        return f"no {what}"
    return f"{what}{'s' if len(found) > 1 else ''} at {listed([f'{each:.1f} Hz' for each in found])}"


def _ratio(shapes: Resonances) -> str:
    """(f / f0)² = 1 + load / motor, of the resonance f and the anti-resonance f0 of two masses on a spring."""
    if len(shapes.resonances) != 1 or len(shapes.antiresonances) != 1 or shapes.resonances[0] <= shapes.antiresonances[0]:
        return ""
    times = (shapes.resonances[0] / shapes.antiresonances[0]) ** 2 - 1.0
    return f"; of two masses on a spring, the load would be {times:.2g} times the motor"


def _note(found: FrequencyResponse) -> str:
    drives = found.instrument.replace("_", " ")
    return (
        f'<p class="note">Of all recordings, fitted or not: {found.windows} windows of {found.seconds:g} s in which the axis '
        f"moves. Torque and velocity are each compared with the {drives}, so that what the drive's own loops do is not taken "
        "for the mechanics. The coherence is that of the worse of both. Grey lines are not reliable (standard deviation above "
        "5 %). The phase has the delay by which torque and position are sampled apart.</p>"
    )
