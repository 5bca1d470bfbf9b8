"""What befalls a mechanism while it runs, against plants that were built so, and against the law."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from plant_bench import PlantBench, placed

from drivetwin.emulator.machine import load_machine
from drivetwin.emulator.plant import Plant


def mass_matrix(plant: Plant) -> np.ndarray:
    matrix = np.zeros((plant.model.nv, plant.model.nv))
    mujoco.mj_forward(plant.model, plant.data)
    mujoco.mj_fullM(plant.model, plant.data, matrix)
    return matrix


@pytest.mark.parametrize(
    ("machine", "axis"), [("scara", "stretch"), ("scara", "rotate"), ("arm", "shoulder"), ("stage", "slide")]
)
def test_a_payload_is_the_mass_that_the_library_would_have_built_in(machine: str, axis: str) -> None:
    """Mass matrix, inverse weights and truth as of a plant that had the effect `payload` at the same place from the start."""
    bench = PlantBench(machine, axis)
    plant = bench.plant
    body = plant.model.nbody - 1 if axis != "rotate" else plant.model.body("hub").id
    x, y, z = plant.model.body_ipos[body]
    built = Plant(bench.machine, (*bench.effects, placed(axis, "payload", mass=0.7, x=x, y=y, z=z)))
    plant.incidents.load(bench.index, "here", 0.7)
    joints = slice(0, plant.model.nv)
    np.testing.assert_allclose(mass_matrix(plant), mass_matrix(built), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(plant.model.dof_M0, built.model.dof_M0[joints], rtol=1e-9)
    if not plant.model.body_simple[body]:  # MuJoCo leaves the armature out there, and a body with a child is not simple
        np.testing.assert_allclose(plant.model.dof_invweight0, built.model.dof_invweight0[joints], rtol=1e-6)
    assert plant.truth()[axis]["inertia"] == pytest.approx(built.truth()[axis]["inertia"], rel=1e-9)


def test_a_load_that_is_off_again_leaves_the_model_as_it_was() -> None:
    plant = Plant(load_machine("scara"), ())
    names = ("body_mass", "body_subtreemass", "body_invweight0", "dof_invweight0", "dof_M0", "actuator_acc0")
    before = {name: getattr(plant.model, name).copy() for name in names}
    for cause in ("first", "second"):
        plant.incidents.load(2, cause, 0.1)
    plant.incidents.load(1, "first", 3.0)
    assert plant.model.body("blade").mass[0] == pytest.approx(before["body_mass"][plant.model.body("blade").id] + 0.2)
    for axis, cause in ((2, "first"), (1, "first"), (2, "second")):
        plant.incidents.unload(axis, cause)
    for name in names:
        np.testing.assert_array_equal(getattr(plant.model, name), before[name])


def test_a_load_on_an_uneven_gear_adds_to_the_links_alone() -> None:
    """Where the rotor's inertia varies on the way, dof_M0 stays links + rotor, as of a plant that was built with the load."""
    ripple = placed("rotate", "transmission_error", amplitude=1e-3, order=2.0)
    bench = PlantBench("scara", "rotate", (ripple,))
    x, y, z = bench.plant.model.body_ipos[bench.plant.model.body("blade").id]
    built = Plant(bench.machine, (ripple, placed("stretch", "payload", mass=0.7, x=x, y=y, z=z)))
    bench.plant.incidents.load(2, "here", 0.7)
    for plant in (bench.plant, built):
        plant._mechanism.step()
    dof = int(bench.dofs[1])
    assert bench.plant.model.dof_M0[dof] == pytest.approx(built.model.dof_M0[dof], rel=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("extra", [(), (("load_friction", {"coefficient": 0.1}),)], ids=["by speed alone", "by load too"])
def test_worn_friction_holds_and_slides_as_its_law(sign: float, extra: tuple[tuple[str, dict[str, float]], ...]) -> None:
    """The plant slid by a stiff loop: 0.8 N·m more friction than before at the same speed."""
    effects = [placed("rotate", "coulomb", coulomb=1.9), placed("rotate", "viscous", viscous=1.15)]
    effects += [placed("rotate", name, **parameters) for name, parameters in extra]
    torques = []
    for more in (0.0, 0.8):
        bench = PlantBench("scara", "rotate", tuple(effects))
        bench.plant.incidents.rub(bench.index, "wear", more, 0.0)
        torques.append(abs(bench.slide_at(sign * 0.3)[1]))
    share = 1.0 - dict(extra).get("load_friction", {}).get("coefficient", 0.0)
    assert (torques[1] - torques[0]) * share == pytest.approx(0.8, rel=0.01)


def test_a_sound_mechanism_has_nothing_to_do() -> None:
    plant = Plant(load_machine("scara"), ())
    incidents = plant.incidents
    assert not incidents.rising
    assert not incidents.misreadings.any()
