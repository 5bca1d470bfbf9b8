"""What keeps an MJCF file from being a model; as a program, `python mjcf_fault.py MODEL.xml`, it writes that to stdout."""

from __future__ import annotations

import re
import sys

import mujoco
import numpy as np

LONGEST = 300
"""Characters of an error that are told."""
_PARSER = re.compile(r"Error=XML_(?:ERROR_)?(\w+) ErrorID=\d+ \(0x[0-9a-f]+\) Line number=(\d+)")
_PARSER_SAYS = {
    "MISMATCHED_ELEMENT": "an element is not closed, or is closed by another name",
    "PARSING_ATTRIBUTE": "an attribute cannot be read: expected name=\"value\"",
    "PARSING_ELEMENT": "an element cannot be read",
    "PARSING_COMMENT": "a comment is not closed",
    "PARSING_TEXT": "there is text where an element is expected, or an element is not closed",
    "PARSING": "an element is not closed, or the file ends too soon",
}
"""By the name of an error of tinyxml2, which MuJoCo reads XML with."""
_NOT_NEGATIVE = ("dof_armature", "dof_damping", "dof_frictionloss")
_FINITE = ("body_mass", "body_inertia", "body_ipos", "dof_armature", "dof_damping", "dof_frictionloss")


def fault(path: str) -> str:
    """What is wrong with a file, to follow its name; empty where nothing is."""
    try:
        model = mujoco.MjModel.from_xml_path(path)
    except (ValueError, RuntimeError, mujoco.FatalError, MemoryError) as error:
        return f"is not a MuJoCo model: {_in_words(str(error))}"[:LONGEST]
    return _not_text(model) or _not_finite(model) or _negative(model) or _no_torque(model)


def _in_words(error: str) -> str:
    """What MuJoCo says, but for its XML parser, which tells a number and a name."""
    found = _PARSER.search(error)
    if found is None:
        return error
    kind, line = found[1], found[2]
    element = re.search(r"XMLElement name=(\w+)", error)
    words = _PARSER_SAYS.get(kind, f"it is not valid XML ({kind.replace('_', ' ').lower()})")
    at = f"line {line}: " if line != "0" else ""
    return f"{at}{words}{f', in <{element[1]}>' if element else ''}"


def _not_text(model: mujoco.MjModel) -> str:
    try:
        bytes(model.names).decode("utf-8")
    except UnicodeDecodeError as error:
        return f"has a name that is not UTF-8 (byte {error.object[error.start]:02X}h): save it as UTF-8"
    return ""


def _not_finite(model: mujoco.MjModel) -> str:
    for name in _FINITE:
        values = getattr(model, name)
        wrong = np.argwhere(~np.isfinite(values))[:, 0]
        if wrong.size:
            body = int(wrong[0]) if name.startswith("body") else int(model.dof_bodyid[wrong[0]])
            return f"has no finite {name.split('_')[1]} on body {model.body(body).name or body}: correct it"
    return ""


def _negative(model: mujoco.MjModel) -> str:
    """Of joints: what would push instead of resisting."""
    for name in _NOT_NEGATIVE:
        wrong = np.flatnonzero(getattr(model, name) < 0.0)
        if wrong.size:
            body = int(model.dof_bodyid[wrong[0]])
            return f"has a negative {name.split('_')[1]} on body {model.body(body).name or body}: correct it"
    return ""


def _no_torque(model: mujoco.MjModel) -> str:
    data = mujoco.MjData(model)
    mujoco.mj_inverse(model, data)
    wrong = np.flatnonzero(~np.isfinite(data.qfrc_inverse))
    if not wrong.size:
        return ""
    joint = int(model.dof_jntid[wrong[0]])
    return f"asks for no finite torque of joint {model.joint(joint).name or joint} at its qpos0: correct what it moves"


if __name__ == "__main__":
    sys.stdout.write(fault(sys.argv[1]))
