"""A robot's URDF as MuJoCo can read it: without shapes, whose files are seldom where it says; and the speeds that it allows."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from xml.etree import ElementTree

import mujoco

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.scratch import scratch
from drivetwin.motion.model_file import named_model

ENDING = ".urdf"


@dataclass(frozen=True)
class Robot:
    """A robot's model, and the greatest speed of a joint [rad/s or m/s] where its file tells one."""

    spec: mujoco.MjSpec
    model: mujoco.MjModel
    speed: dict[str, float]


def read_robot(path: Path) -> Robot:
    """An MJCF file as it is, or a URDF by its inertias alone.

    Raises UserError naming the file for what is neither, and for a URDF whose link moves without a mass.
    """
    if path.suffix.lower() != ENDING:
        return Robot(*named_model(path), {})
    try:
        root = ElementTree.fromstring(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise UserError(f"no model at {path}") from None
    except (OSError, UnicodeDecodeError, ElementTree.ParseError) as error:
        raise UserError(f"{path} is not a URDF: {error}") from None
    if root.tag != "robot":
        raise UserError(f"{path} is not a URDF: its root is <{root.tag}>, expected <robot>")
    _leave_out_shapes(root)
    with scratch() as folder:
        bare = folder / path.name
        ElementTree.ElementTree(root).write(bare, encoding="utf-8")
        try:
            spec, model = named_model(bare)
        except UserError as error:
            raise UserError(str(error).replace(str(bare), str(path))) from None
    return Robot(spec, model, _speeds(path, root))


def _leave_out_shapes(root: ElementTree.Element) -> None:
    """Those of a link whose inertia is told; without it MuJoCo infers it from them."""
    for link in root.iter("link"):
        told = link.find("inertial") is not None
        for shape in [one for one in link if one.tag in ("visual", "collision")]:
            if told or shape.tag == "visual" or shape.find("geometry/mesh") is not None:
                link.remove(shape)


def _speeds(path: Path, root: ElementTree.Element) -> dict[str, float]:
    found = {}
    for joint in root.iter("joint"):
        limit = joint.find("limit")
        told = None if limit is None else limit.get("velocity")
        if told is None:
            continue
        try:
            speed = float(told)
        except ValueError:
            raise UserError(f"{path}: joint {joint.get('name')!r}: limit velocity {told!r} is not a number") from None
        if isfinite(speed) and speed > 0.0:
            found[str(joint.get("name"))] = speed
    return found
