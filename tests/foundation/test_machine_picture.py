"""The picture of a machine: every body is in it, nearer ones on top, and it is well-formed SVG for any kind of geom."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import mujoco
import pytest

from drivetwin.foundation.machine_picture import HEIGHT, WIDTH, machine_picture

ROOT = Path(__file__).parents[2]
MODELS = sorted([*ROOT.glob("controller/machines/*/model.xml"), *ROOT.glob("docs/examples/*/model.xml")])


def parsed(model: mujoco.MjModel, *axes: str) -> ElementTree.Element:
    return ElementTree.fromstring(machine_picture(model, axes))


def corners(polygon: ElementTree.Element) -> list[tuple[float, float]]:
    return [(float(x), float(y)) for x, _, y in (pair.partition(",") for pair in polygon.attrib["points"].split())]


def model_of(body: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{body}</worldbody></mujoco>")


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.parent.name)
def test_a_machine_is_drawn_within_the_picture_with_its_axes_named(path: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(path))
    names = [model.joint(at).name for at in range(model.njnt)]
    picture = parsed(model, *names)
    drawn = [point for polygon in picture.findall("polygon") for point in corners(polygon)]
    assert all(0.0 <= x <= WIDTH and 0.0 <= y <= HEIGHT for x, y in drawn)
    assert [text.text for text in picture.findall("text")] == names


@pytest.mark.parametrize("kind", ["sphere", "capsule", "cylinder", "ellipsoid", "box"])
def test_every_kind_of_geom_is_drawn(kind: str) -> None:
    assert parsed(model_of(f'<geom type="{kind}" size="0.1 0.2 0.3"/>')).findall("polygon")


def test_of_a_box_the_three_sides_that_face_the_viewer_are_seen() -> None:
    assert len(parsed(model_of('<geom type="box" size="0.1 0.2 0.3"/>')).findall("polygon")) == 3


def test_what_is_nearer_is_drawn_later() -> None:
    """The viewer stands at positive x, negative y, above: the box there covers the other one, in either order of the file."""
    far, near = '<geom type="sphere" size="0.1" pos="-1 1.4 0"/>', '<geom type="sphere" size="0.3" pos="1 -1.4 0"/>'
    for body in (far + near, near + far):
        widths = [
            max(x for x, _ in points) - min(x for x, _ in points)
            for points in map(corners, parsed(model_of(body)).findall("polygon"))
        ]
        assert widths[1] == pytest.approx(3.0 * widths[0], rel=0.02)


def test_a_body_without_geoms_is_the_box_of_its_inertia() -> None:
    box = '<body><inertial mass="12" pos="0 0 0" diaginertia="0.52 0.4 0.2"/><joint name="x"/></body>'
    like = '<body><geom type="box" size="0.1 0.2 0.3" mass="12"/><joint name="x"/></body>'
    drawn, expected = (parsed(model_of(each)).findall("polygon") for each in (box, like))
    assert [corners(each) for each in drawn] == [corners(each) for each in expected]


def test_a_model_without_a_body_has_no_picture() -> None:
    assert machine_picture(model_of('<geom type="plane" size="1 1 1"/>')) == ""


def test_names_are_escaped() -> None:
    model = model_of('<body><joint name="a&lt;b"/><geom size="0.1"/></body>')
    assert [text.text for text in parsed(model, "a<b").findall("text")] == ["a<b"]
