"""What a diagnosis reads, and what it refuses before any work: what was expected, what came, where, and what to do."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import mujoco

from drivetwin.diagnosis.prepare.cutoff import USUAL
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.files import sha256
from drivetwin.motion.inverse_dynamics import read_mjcf
from drivetwin.motion.model_file import motors_of
from drivetwin.motion.pieces import read_all
from drivetwin.recording.reader import SIGNALS, check_joints, find_recordings
from drivetwin.recording.recording import Recording

LOWEST_CUTOFF = 1.0
"""Below it [Hz] the filter takes the motion away."""

_ONE_DEGREE = {int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)}


@dataclass(frozen=True)
class Inputs:
    """A model and its recordings, checked; `validation` is empty where blocks of `training` are to be held back."""

    model: Path
    training: tuple[Recording, ...]
    validation: tuple[Recording, ...]

    @property
    def files(self) -> list[Path]:
        """Every file that was read, once."""
        return list(dict.fromkeys([self.model, *(file for each in (*self.training, *self.validation) for file in each.files)]))


def read_inputs(
    model: Path, training: Sequence[Path], validation: Sequence[Path], *, cutoff_hz: float | None, allow_gaps: bool
) -> Inputs:
    """Read the model's recordings; a folder of recordings counts as all of them.

    Raises UserError where the model is no MJCF, a recording breaks the contract of recordings, an axis has no hinge or slide
    joint, recordings are of other axes than the first, one is given twice, or `cutoff_hz` [Hz] fits none of them.
    """
    _refuse_twice(_folders(training), _folders(validation))
    if cutoff_hz is not None and not (math.isfinite(cutoff_hz) and cutoff_hz >= LOWEST_CUTOFF):
        raise UserError(f"--cutoff {cutoff_hz:g}: expected a frequency of {LOWEST_CUTOFF:g} Hz or more")
    mujoco_model = _mjcf(model)
    fitted, held = (tuple(read_all(paths, cutoff_hz or USUAL, allow_gaps=allow_gaps)) for paths in (training, validation))
    for recording in (*fitted, *held):
        _check_axes(model, mujoco_model, recording)
        _refuse_other_axes(fitted[0], recording)
    _refuse_same_name(held or fitted)
    if cutoff_hz is not None:
        _refuse_high_cutoff(cutoff_hz, (*fitted, *held))
    return Inputs(model, fitted, held)


def _folders(paths: Sequence[Path]) -> list[Path]:
    return [folder for path in paths for folder in find_recordings(path)]


def _refuse_twice(training: Sequence[Path], validation: Sequence[Path]) -> None:
    """The same samples count once, whatever their folder is called; and never both fitted and validated on."""
    seen: dict[str, str] = {}
    for role, folders in (("RECORDING", training), ("--validate", validation)):
        for folder in folders:
            samples = next((folder / name for name in SIGNALS if (folder / name).is_file()), None)
            digest = sha256(samples) if samples else ""
            if samples and digest in seen:
                raise UserError(
                    f"{folder} ({role}) has the same samples as {seen[digest]}; a recording counts once, and what was fitted "
                    "cannot be validated: give another one"
                )
            seen[digest] = f"{folder} ({role})"


def _mjcf(path: Path) -> mujoco.MjModel:
    """The compiled model of an MJCF file."""
    if not path.is_file():
        raise UserError(f"no model at {path}: give the path of a MuJoCo XML file")
    try:
        root = ElementTree.parse(path).getroot().tag
    except (ElementTree.ParseError, UnicodeDecodeError) as error:
        raise UserError(f"{path} is not XML ({error}): give the path of a MuJoCo model (MJCF)") from None
    if root != "mujoco":
        raise UserError(f"{path} is <{root}>, not a MuJoCo model <mujoco>: convert it to MJCF")
    return read_mjcf(path)


def _check_axes(path: Path, model: mujoco.MjModel, recording: Recording) -> None:
    """Every axis of the recording turns or slides a joint of the model; an actuator that it names drives that one."""
    joints = {model.joint(index).name: index for index in range(model.njnt)}
    where = recording.files[0] if recording.files else recording.name
    check_joints(recording, joints)
    for axis, info in recording.info.axes.items():
        joint = joints[info.joint]
        if int(model.jnt_type[joint]) not in _ONE_DEGREE:
            kind = mujoco.mjtJoint(int(model.jnt_type[joint])).name.removeprefix("mjJNT_").lower()
            raise UserError(
                f"{where}: axis {axis} belongs to joint {info.joint!r}, which is a {kind} joint in {path}; an axis is a hinge "
                "or a slide: correct `joint` in recording.json, or take the axis out"
            )
        motors = motors_of(model, joint)
        all_actuators = [model.actuator(number).name for number in range(model.nu)]
        if info.actuator is not None and info.actuator not in motors and (motors or info.actuator in all_actuators):
            driven = ", ".join(name or "a motor without a name" for name in motors) or "none of its actuators"
            raise UserError(
                f"{where}: axis {axis} names actuator {info.actuator!r}; joint {info.joint!r} of {path} is driven by {driven}: "
                "correct `actuator` in recording.json"
            )


def _refuse_other_axes(first: Recording, recording: Recording) -> None:
    """All recordings are of the axes of the first, on the same joints."""
    expected = {axis: info.joint for axis, info in first.info.axes.items()}
    came = {axis: info.joint for axis, info in recording.info.axes.items()}
    if came != expected:
        raise UserError(
            f"{recording.files[0] if recording.files else recording.name}: expected the axes of recording '{first.name}', "
            f"{_listed(expected)}, and got {_listed(came)}; diagnose recordings of other axes on their own"
        )


def _listed(axes: dict[str, str]) -> str:
    named = [axis if axis == joint else f"{axis} (joint {joint})" for axis, joint in axes.items()]
    return ", ".join(named) or "none"


def _refuse_same_name(predicted: Sequence[Recording]) -> None:
    """Each gets a file prediction/NAME.parquet."""
    ordered = sorted(predicted, key=lambda recording: recording.name)
    for one, other in pairwise(ordered):
        if one.name == other.name:
            raise UserError(
                f"{one.source} and {other.source} are both named '{one.name}', and so would be prediction/{one.name}.parquet: "
                "rename one"
            )


def _refuse_high_cutoff(cutoff_hz: float, recordings: Sequence[Recording]) -> None:
    highest = max(0.5 / recording.info.sample_period for recording in recordings)
    if cutoff_hz >= highest:
        raise UserError(
            f"--cutoff {cutoff_hz:g}: expected a frequency below {highest:g} Hz, half the highest sample rate of the recordings"
        )
