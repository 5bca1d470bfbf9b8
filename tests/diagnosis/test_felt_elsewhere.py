"""A tool close to the elbow of an arm: the elbow's motor feels little of it, the shoulder's much."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from carts_bench import PERIOD, TIME, slope, waves

from drivetwin.diagnosis.diagnose import diagnose
from drivetwin.diagnosis.report.build import _alternatives
from drivetwin.diagnosis.report.divided import OTHER_AXES
from drivetwin.diagnosis.report.prediction import Patch
from drivetwin.diagnosis.report.result import Array
from drivetwin.diagnosis.settings import Settings
from drivetwin.diagnosis.weigh.averaging import Answer, Weighed
from drivetwin.diagnosis.weigh.proposal import Proposal
from drivetwin.emulator.effects import PlacedEffect
from drivetwin.emulator.effects.payload import Payload
from drivetwin.recording.recording import Recording, RecordingInfo

TOOL, REACH = 0.8, 0.02
"""[kg], and how far from the elbow's own axis [m]."""
MODEL = """<mujoco model="arm"><compiler angle="radian"/><worldbody>
<body><joint name="shoulder" axis="0 -1 0" armature="2" frictionloss="9" damping="2"/>
<inertial pos="0.25 0 0" mass="6" diaginertia="0.1 0.1 0.1"/>
<body pos="0.5 0 0"><joint name="elbow" axis="0 -1 0" armature="0.4" frictionloss="2" damping="0.6"/>
<inertial pos="0.2 0 0" mass="5" diaginertia="0.1 0.1 0.1"/>TOOL</body></body></worldbody>
<actuator><motor name="shoulder" joint="shoulder"/><motor name="elbow" joint="elbow"/></actuator></mujoco>"""


def moved(name: str, positions: dict[str, Array]) -> Recording:
    """What the motors of the arm with the tool give, by MuJoCo's inverse dynamics and the friction that the file tells."""
    inertial = f'<body><inertial pos="{REACH} 0 0" mass="{TOOL}" diaginertia="1e-9 1e-9 1e-9"/></body>'
    model = mujoco.MjModel.from_xml_string(MODEL.replace("TOOL", inertial))
    loss, damping = model.dof_frictionloss.copy(), model.dof_damping.reshape(2, -1)[:, 0].copy()
    model.dof_frictionloss[:] = 0.0
    model.dof_damping[:] = 0.0
    data = mujoco.MjData(model)
    at = np.column_stack(list(positions.values()))
    speed = np.column_stack([slope(each) for each in at.T])
    acceleration = np.column_stack([slope(each) for each in speed.T])
    torque = loss * np.sign(speed) + damping * speed
    for row in range(len(at)):
        data.qpos[:], data.qvel[:], data.qacc[:] = at[row], speed[row], acceleration[row]
        mujoco.mj_inverse(model, data)
        torque[row] += data.qfrc_inverse
    rng = np.random.default_rng(len(name))
    columns = {
        axis: {"position": each, "torque": torque[:, k] + 0.02 * rng.standard_normal(len(each))}
        for k, (axis, each) in enumerate(positions.items())
    }
    axes = {axis: {"joint": axis, "actuator": axis, "torque_resolution": 1e-3, "position_resolution": 1e-7} for axis in columns}
    info = RecordingInfo.model_validate({"schema": "recording/1", "machine": "arm", "sample_period": PERIOD, "axes": axes})
    return Recording(name, info, TIME, columns)


def test_a_cause_has_its_share_of_every_axis_that_feels_it(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    path.write_text(MODEL.replace("TOOL", ""), encoding="utf-8")
    fitted = {"shoulder": waves((0.6, 0.3, 0.0), (0.1, 1.1, 1.0)), "elbow": waves((0.5, 0.45, 0.5), (0.1, 1.7, 0.0))}
    unseen = {"shoulder": waves((0.5, 0.35, 0.4), (0.1, 0.9, 0.0)), "elbow": waves((0.6, 0.4, 0.0), (0.1, 1.5, 2.0))}
    found = diagnose(path, [moved("fitted", fitted)], [moved("held", unseen)], Settings(), lambda *_: None)
    first = found.causes[0]
    assert (first.effect, first.axis) == (Payload.name, "elbow")
    assert first.parameters["mass"].value == pytest.approx(TOOL, rel=0.05)
    assert next(part.share for part in found.axes["shoulder"].shares if part.of == OTHER_AXES) > 0.9
    assert first.share > 0.9


@pytest.mark.parametrize(("shoulder", "shares"), [(0.0, []), (0.6, [0.6])])
def test_an_effect_that_may_be_there_is_named_where_a_gap_feels_it(shoulder: float, shares: list[float]) -> None:
    """The shoulder alone has a gap; what the tool would take of the elbow's torque, which has none, counts for nothing."""
    tool = PlacedEffect("elbow", Payload(TOOL), {})
    proposal = Proposal(tool, 9.0, 0.0, {"shoulder": shoulder, "elbow": 0.9}, {}, (), frozenset(), 1)
    answer = Answer(None, 0.5, False, (Weighed(proposal, 0.5, False),))
    named = _alternatives([answer], Patch(), {"shoulder": 1.0}, {}, Settings())
    assert [(one.effect, one.axis, one.share) for one in named] == [("payload", "elbow", share) for share in shares]
