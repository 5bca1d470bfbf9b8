"""Forms in which MJCF can say an arm of two joints, and the files that they name."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Form:
    """Pieces of an MJCF file of an arm with two joints, by where they stand."""

    compiler: str = 'angle="radian"'
    head: str = ""
    upper: str = '<inertial pos="0.2 0.01 0.02" mass="3" diaginertia="0.3 0.2 0.1"/>'
    lower: str = '<inertial pos="0.1 0 0.03" mass="1.5" diaginertia="0.02 0.03 0.01"/>'
    shoulder: str = 'armature="0.1" frictionloss="0.7" damping="0.4"'
    elbow: str = 'armature="0.05" frictionloss="0.2" damping="0.1"'
    world: str = ""
    drives: str = '<motor name="m1" joint="shoulder"/><motor name="m2" joint="elbow"/>'
    tail: str = ""

    @property
    def xml(self) -> str:
        return f"""<mujoco model="arm"><compiler {self.compiler}/>{self.head}<worldbody>{self.world}
<body name="upper" pos="0 0 1" euler="0.3 0.2 0.1"><joint name="shoulder" axis="0 1 0" {self.shoulder}/>{self.upper}
<body name="lower" pos="0.4 0 0"><joint name="elbow" axis="0.2 1 0" pos="0.01 0 0" {self.elbow}/>{self.lower}</body></body>
</worldbody><actuator>{self.drives}</actuator>{self.tail}</mujoco>"""


MESH = '<asset><mesh name="bar" file="bar.obj" scale="0.3 0.2 0.1"/></asset>'
BAR = '<geom type="mesh" mesh="bar"/>'
DRIVES = '<{0} name="m1" joint="shoulder" {1}/><{0} name="m2" joint="elbow" {1}/>'
INERTIA = {
    "diaginertia, turned": Form(upper='<inertial pos="0.2 0 0" euler="0.1 0.7 0.2" mass="3" diaginertia="0.3 0.2 0.11"/>'),
    "fullinertia": Form(upper='<inertial pos="0.2 0 0" mass="3" fullinertia="0.3 0.2 0.25 0.04 -0.03 0.02"/>'),
    "fullinertia, balanced": Form(
        'angle="radian" balanceinertia="true"',
        upper='<inertial pos="0.2 0 0" mass="3" fullinertia="0.9 0.2 0.25 0.04 -0.03 0.02"/>',
    ),
    "bounds": Form('angle="radian" boundmass="4" boundinertia="0.25"'),
    "shapes": Form(
        upper='<geom type="capsule" size="0.04" fromto="0 0 0 0.4 0.01 0.1"/>'
        '<geom type="box" size="0.1 0.05 0.02" density="3000"/>',
        lower='<geom type="cylinder" size="0.03 0.2" pos="0.123456789012345 0 0" mass="1.1"/>',
    ),
    "some groups of shapes": Form('inertiagrouprange="0 1"', upper='<geom size="0.1"/><geom size="0.2" group="3"/>', elbow=""),
    "shapes over inertials": Form(
        'angle="radian" inertiafromgeom="true"', upper='<geom size="0.1"/>', lower=f'{Form.lower}<geom size="0.1"/>'
    ),
    "a total mass": Form('angle="radian" settotalmass="7.7"'),
    "meshes": Form(head=MESH, upper=BAR, lower=f'{BAR}<geom type="mesh" mesh="bar" pos="0 0.1 0" euler="0.1 0 0"/>'),
    "meshes in a folder": Form('angle="radian" meshdir="shapes"', head=MESH.replace("bar.obj", "nut.obj"), upper=BAR),
    "fused bodies": Form(
        'angle="radian" fusestatic="true"', upper=f'{Form.upper}<body pos="0 0.1 0"><geom size="0.1"/></body>'
    ),
    "a frame": Form(upper=f'{Form.upper}<frame euler="0.3 0 0"><body pos="0 0.1 0"><geom size="0.1"/></body></frame>'),
    "copies": Form(upper=f'{Form.upper}<replicate count="3" offset="0.1 0 0"><geom size="0.05"/></replicate>'),
    "an included file": Form(upper='<include file="part.xml"/>'),
    "an attached model": Form(
        head='<asset><model name="tool" file="tool/tool.xml"/></asset>',
        lower='<attach model="tool" body="tip" prefix="t_"/><geom size="0.05"/>',
    ),
}
JOINT = {
    "default classes": Form(
        head='<default><joint damping="0.123456789012" frictionloss="0.3"/><default class="j">'
        '<joint armature="0.2"/></default></default>',
        shoulder='class="j"',
        elbow="",
    ),
    "degrees": Form(
        'angle="degree"', shoulder='ref="30" stiffness="12" springref="-20"', elbow='stiffness="3" springref="50" ref="10"'
    ),
    "radians": Form(shoulder='ref="0.5" stiffness="12" springref="-0.3"', elbow='stiffness="3" springref="0.9"'),
    "a spring by its time": Form(shoulder='springdamper="0.2 0.7"', elbow='armature="0.3"'),
    "no friction": Form(shoulder="", elbow=""),
    "curved damping": Form(shoulder='damping="0.4 0.2 0.1"'),
    "damping turned off": Form(head='<option><flag damper="disable" frictionloss="disable"/></option>'),
    "gravity turned off": Form(head='<option><flag gravity="disable"/></option>'),
    "air": Form(
        head='<option density="900" viscosity="3" wind="1 0 0"/>',
        upper='<geom type="box" size="0.1 0.2 0.3" fluidshape="ellipsoid"/>',
    ),
    "gravity compensated": Form(lower=f'{Form.lower}<body gravcomp="1" pos="0 0.2 0"><geom size="0.1"/></body>'),
    "gravity compensated by the motor": Form(
        shoulder='actuatorgravcomp="true"',
        lower='<body gravcomp="0.8" pos="0 0.2 0"><geom size="0.1"/></body><geom size="0.1"/>',
    ),
    "discrete time": Form(head='<option integrator="implicit" timestep="0.01"><flag invdiscrete="enable"/></option>'),
}
DRIVE = {
    "motor": Form(drives=DRIVES.format("motor", 'gear="50" ctrlrange="-1 1"')),
    "motors with rotors": Form(drives=DRIVES.format("motor", 'gear="5" armature="0.003" damping="0.002 0.001 0.0005"')),
    "position": Form(drives=DRIVES.format("position", 'kp="100" dampratio="0.7"')),
    "velocity": Form(drives=DRIVES.format("velocity", 'kv="100"')),
    "general": Form(drives=DRIVES.format("general", 'gaintype="affine" gainprm="3" biastype="affine" biasprm="0 -3 -1"')),
    "intvelocity": Form(drives=DRIVES.format("intvelocity", 'kp="100" actrange="-1 1"')),
    "dcmotor": Form(drives=DRIVES.format("dcmotor", 'motorconst="0.1 0.1" resistance="2" armature="0.001" gear="20"')),
    "two on a joint": Form(
        drives='<position joint="shoulder" kp="9"/><velocity joint="shoulder" kv="1"/><motor joint="elbow"/>'
    ),
    "in the parent": Form(drives='<motor jointinparent="shoulder"/><motor jointinparent="elbow"/>'),
    "by a tendon": Form(
        drives='<position name="m1" tendon="both" kp="3"/><motor joint="elbow"/>',
        tail='<tendon><fixed name="both"><joint joint="shoulder" coef="2"/><joint joint="elbow" coef="-1"/></fixed></tendon>',
    ),
    "none": Form(drives=""),
    "none, and defaults of motors": Form(head='<default><motor ctrllimited="true"/><general gear="7"/></default>', drives=""),
}
BESIDE = {
    "what watches": Form(
        head='<asset><texture name="wood" type="2d" builtin="checker" width="8" height="8"/>'
        '<material name="wood" texture="wood"/>'
        '<hfield name="hill" nrow="2" ncol="2" size="1 1 1 1" elevation="0 1 1 0"/></asset>',
        world='<light pos="0 0 3"/><camera name="eye" pos="0 0 3"/><geom type="hfield" hfield="hill" pos="5 5 0"/>'
        '<geom name="floor" type="plane" size="1 1 1" material="wood"/>',
        lower=f'{Form.lower}<geom name="shell" size="0.2" mass="0" material="wood"/><site name="tip" material="wood"/>',
        tail='<contact><pair geom1="floor" geom2="shell"/><exclude body1="upper" body2="lower"/></contact>'
        '<sensor><force site="tip"/><touch site="tip"/></sensor><custom><tuple name="t">'
        '<element objtype="geom" objname="shell" prm="1"/></tuple></custom>'
        '<keyframe><key name="home" qpos="0.3 0.2" ctrl="1 1"/></keyframe>',
    ),
    "a box that lies about": Form(
        world='<body name="box" pos="3 0 0"><freejoint name="free"/><geom type="box" size="0.1 0.1 0.1"/></body>'
    ),
    "a lamp on a ball joint": Form(
        lower=f'{Form.lower}<body pos="0 0 0.3"><joint type="ball" damping="1"/><geom size="0.1"/></body>'
    ),
    "a joint nobody recorded": Form(
        lower=f'{Form.lower}<body pos="0 0 0.3"><joint name="wrist" ref="0.2"/><geom size="0.1" pos="0.2 0 0"/></body>'
    ),
    "a tendon with a spring": Form(
        lower=f'{Form.lower}<geom name="pulley" type="cylinder" size="0.05 0.05" mass="0.1" euler="1.57 0 0"/>'
        f'<site name="tip" pos="0.2 0 0"/>',
        world='<site name="base" pos="0 0 2"/>',
        tail='<tendon><spatial stiffness="30" damping="2"><site site="base"/><geom geom="pulley"/>'
        '<site site="tip"/></spatial></tendon>',
    ),
}
FORMS = {**INERTIA, **JOINT, **DRIVE, **BESIDE}
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
TOOL = f"""<mujoco><compiler angle="degree" meshdir="looks" inertiafromgeom="true" eulerseq="zyx"/>
{MESH.replace("bar.obj", "claw.obj")}<worldbody>
<body name="tip" pos="0.1 0 0" euler="20 30 40"><inertial pos="0 0 0" mass="9" diaginertia="1 1 1"/>{BAR}</body>
</worldbody></mujoco>"""


def written(folder: Path, form: Form) -> Path:
    """The file, with those that it may name."""
    (folder / "shapes").mkdir(parents=True)
    (folder / "tool" / "looks").mkdir(parents=True)
    for mesh in ("bar.obj", "shapes/nut.obj", "tool/looks/claw.obj"):
        (folder / mesh).write_text(TETRAHEDRON, encoding="utf-8")
    (folder / "part.xml").write_text(f"<mujocoinclude>{Form.upper}</mujocoinclude>", encoding="utf-8")
    (folder / "tool" / "tool.xml").write_text(TOOL, encoding="utf-8")
    (folder / "arm.xml").write_text(form.xml, encoding="utf-8")
    return folder / "arm.xml"
