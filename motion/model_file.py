"""An MJCF file prepared for work: named, with explicit inertia and friction, without what has no torque; and written again."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable
from itertools import count
from pathlib import Path

import mujoco
import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.motion.compilation import check_compiles

ON_JOINT = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
"""Transmissions by which an actuator drives a joint."""
EXACT = 1e-12
"""Share by which mass and inertia that are read again may differ."""


def named_model(path: Path) -> tuple[mujoco.MjSpec, mujoco.MjModel]:
    """Specification and model of an MJCF file; bodies and actuators that it leaves without a name, as MJCF allows, get one.

    Its bodies are those of the compiled model: what `fusestatic` fuses is fused. Files of meshes, height fields, skins and
    textures are found from wherever the specification is written to. Raises UserError for a file that MuJoCo refuses.
    """
    check_compiles(path)
    spec = mujoco.MjSpec.from_file(str(path))
    for kind, elements in (("body", spec.bodies), ("actuator", spec.actuators)):
        taken = {element.name for element in elements}
        free = (name for number in count() if (name := f"{kind}_{number}") not in taken)
        for element in elements:
            element.name = element.name or next(free)
    _find_files(spec, path)
    model = spec.compile()
    spec.compiler.fusestatic = False
    return spec, model


def working_spec(path: Path, motors: Callable[[mujoco.MjSpec], None]) -> mujoco.MjSpec:
    """The specification with nothing that has no part in the torque, friction where it acts, and each inertia told outright.

    `motors` adds those that are missing. Compiling it takes no meshes.
    """
    spec, model = named_model(path)
    state_inertia(spec, model)
    state_springs(spec, model)
    _state_friction(spec, model)
    _leave_out_what_watches(spec)
    _leave_out_looks(spec)
    motors(spec)
    return spec


def state_inertia(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Every body's mass, centre and principal inertia as the compiled model has them, whatever they came of."""
    for body in spec.bodies[1:]:
        one = model.body(body.name)
        body.explicitinertial = bool(one.mass[0] > 0.0)
        if body.explicitinertial:
            body.mass, body.ipos, body.iquat = float(one.mass[0]), one.ipos, one.iquat
            body.fullinertia, body.inertia = np.full(6, np.nan), one.inertia
        for compiler in (spec.compiler, body.compiler):
            compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
            compiler.settotalmass = -1.0
            compiler.balanceinertia, compiler.boundmass, compiler.boundinertia = False, 0.0, 0.0


def state_springs(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Stiffness and damping of springs that are given by time constant and damping ratio: they stay, whatever hangs on them."""
    for joint, stiffness, dof in zip(spec.joints, model.jnt_stiffness, model.jnt_dofadr, strict=True):
        if np.any(joint.springdamper):
            joint.stiffness[0], joint.damping[0] = stiffness, model.dof_damping[dof]
            joint.springdamper = (0.0, 0.0)


def state_motors(spec: mujoco.MjSpec, joints: Container[str]) -> None:
    """Damping and inertia of the actuators of some hinges and slides, on these joints."""
    for actuator in spec.actuators:
        joint = spec.joint(actuator.target) if actuator.trntype in ON_JOINT and actuator.target in joints else None
        if joint is not None and joint.type in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE):
            joint.armature += actuator.gear[0] ** 2 * actuator.armature
            joint.damping += actuator.gear[0] ** 2 * np.asarray(actuator.damping)
            actuator.armature, actuator.damping = 0.0, (0.0, 0.0, 0.0)


def _state_friction(spec: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Damping and inertia of actuators on the joints that they drive; none that the model's options turn off."""
    state_motors(spec, {joint.name for joint in spec.joints})
    bit = mujoco.mjtDisableBit
    off = int(model.opt.disableflags)
    for joint in spec.joints:
        if off & int(bit.mjDSBL_DAMPER):
            joint.damping = (0.0, 0.0, 0.0)
        if off & (int(bit.mjDSBL_FRICTIONLOSS) | int(bit.mjDSBL_CONSTRAINT)):
            joint.frictionloss = 0.0


def as_mjcf(spec: mujoco.MjSpec, model: mujoco.MjModel) -> str:
    """The specification with the numbers of `model`, which was compiled of it, in its own notation and to the last digit.

    Comments, included files and shortcuts are written out. Raises UserError where some of its text is not UTF-8.
    """
    spec.compiler.savecompiled = spec.compiler.savecanonical = False
    try:
        if (xml := _as_written(spec, model)) is not None:
            return xml
        state_inertia(spec, model)
        return str(spec.to_xml())
    except UnicodeDecodeError as error:
        byte = f"{error.object[error.start]:02X}h"
        raise UserError(f"the model has text, perhaps a comment, that is not UTF-8 (byte {byte}): save it as UTF-8") from None


def _as_written(spec: mujoco.MjSpec, model: mujoco.MjModel) -> str | None:
    """None where the file infers inertia anew, or where one file cannot infer it as those did of which it is made."""
    try:
        spec.copy_back(model)
        xml = str(spec.to_xml())
        again = mujoco.MjModel.from_xml_string(xml)
    except UnicodeDecodeError:
        raise
    except (ValueError, mujoco.FatalError):
        return None
    names = ("body_mass", "body_inertia", "body_ipos", "body_iquat")
    same = (np.allclose(getattr(again, name), getattr(model, name), rtol=EXACT, atol=EXACT) for name in names)
    return xml if again.nbody == model.nbody and all(same) else None


def motors_of(model: mujoco.MjModel, joint: int) -> list[str]:
    """Names of the actuators that drive a joint, by its number."""
    on_joint = {int(kind) for kind in ON_JOINT}
    return [
        model.actuator(number).name
        for number in range(model.nu)
        if int(model.actuator_trntype[number]) in on_joint and int(model.actuator_trnid[number, 0]) == joint
    ]


def _leave_out_looks(spec: mujoco.MjSpec) -> None:
    """Shapes, but for those that tendons wrap and fluids flow round, and what they look like."""
    if spec.flexes or spec.option.density or spec.option.viscosity:
        return
    _delete(spec, spec.skins, spec.lights)
    wrapped = {wrap.target.name for tendon in spec.tendons for wrap in tendon.path if wrap.target is not None}
    _delete(spec, [geom for geom in spec.geoms if not geom.name or geom.name not in wrapped])
    for element in (*spec.geoms, *spec.sites, *spec.tendons):
        element.material = ""
    _delete(spec, spec.meshes, spec.hfields, spec.materials, spec.textures)


def _leave_out_what_watches(spec: mujoco.MjSpec) -> None:
    """Sensors, keyframes, contacts, cameras."""
    _delete(spec, spec.sensors, spec.keys, spec.pairs, spec.excludes, spec.tuples, spec.cameras)


def _delete(spec: mujoco.MjSpec, *elements: Iterable[object]) -> None:
    for element in [each for some in elements for each in some]:
        spec.delete(element)


def _find_files(spec: mujoco.MjSpec, path: Path) -> None:
    """Tell where assets are, wherever the specification is written to; those of attached models are with these."""
    textures = [texture for texture in spec.textures if texture.file]
    if not (spec.meshes or spec.hfields or spec.skins or textures):
        return
    folder = path.resolve().parent
    meshes = [mesh for mesh in (*spec.meshes, *spec.hfields) if mesh.file]
    places = [*((mesh, mesh.compiler.meshdir) for mesh in meshes), *((each, each.compiler.texturedir) for each in textures)]
    elsewhere = [(asset, place) for asset, place in places if not (folder / place / asset.file).is_file()]
    spec.meshdir, spec.texturedir = (str(folder / own) for own in (spec.meshdir, spec.texturedir))
    if elsewhere:
        files = [Path(file).resolve() for file in mujoco.mju_getXMLDependencies(str(path))]
        for asset, place in elsewhere:
            tail = (Path(place) / asset.file).parts
            found = [file for file in files if file.parts[-len(tail) :] == tail]
            asset.file = str(found[0]) if found else asset.file
