"""A picture of a machine from its MuJoCo model, as SVG: needs no renderer, no graphics driver and no network."""

from __future__ import annotations

import colorsys
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from html import escape

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

Array = NDArray[np.float64]

WIDTH, HEIGHT, MARGIN = 520.0, 340.0, 34.0
"""Of the picture [px]; the margin holds the names of the axes."""
AZIMUTH, ELEVATION = np.radians(-55.0), np.radians(24.0)
"""Where the viewer stands."""
_AROUND = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
_LIGHT = np.array([0.3, -0.5, 0.81])
_ACCENT = "#d1495b"
_FEW_FACES = 400
"""A mesh with more faces is drawn as its outline."""


@dataclass(frozen=True)
class _Facet:
    """A convex patch in world coordinates (n, 3) [m], its outward normal (3,) (None: a silhouette), and its hue."""

    corners: Array
    normal: Array | None
    hue: float


Solid = Sequence[_Facet]
"""The facets of one convex body."""


def machine_picture(model: mujoco.MjModel, axes: Collection[str] = ()) -> str:
    """The machine at its home position as an `<svg>`; the joints named in `axes` are marked. Empty where there is no body.

    Geoms are drawn as they are; a body without geoms as the box that has its inertia. Planes are left out.
    """
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    solids = [solid for body in range(model.nbody) for solid in _body(model, data, body)]
    if not solids:
        return ""
    view = _View.on(np.concatenate([facet.corners for solid in solids for facet in solid]))
    drawn = [view.polygon(facet) for solid in sorted(solids, key=view.depth, reverse=True) for facet in view.visible(solid)]
    marks = [view.axis(model, data, joint) for joint in range(model.njnt) if model.joint(joint).name in axes]
    name = escape(model.names.split(b"\0", 1)[0].decode() or "machine")
    return (
        f'<svg class="machine" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" width="{WIDTH:g}" role="img" '
        f'aria-label="{name}, drawn from its model">{"".join(drawn)}{"".join(marks)}</svg>'
    )


@dataclass(frozen=True)
class _View:
    """Parallel projection onto the picture: `right`, `up` and `towards` the viewer (3,), the centre (2,) and px a metre."""

    right: Array
    up: Array
    towards: Array
    centre: Array
    scale: float

    @classmethod
    def on(cls, points: Array) -> _View:
        """The view in which all points (n, 3) fit."""
        across = np.array([-np.sin(AZIMUTH), np.cos(AZIMUTH), 0.0])
        towards = np.array([np.cos(AZIMUTH) * np.cos(ELEVATION), np.sin(AZIMUTH) * np.cos(ELEVATION), np.sin(ELEVATION)])
        up = np.cross(towards, across)
        flat = np.column_stack([points @ across, points @ up])
        low, high = flat.min(axis=0), flat.max(axis=0)
        room = np.array([WIDTH, HEIGHT]) - 2.0 * MARGIN
        return cls(across, up, towards, (low + high) / 2.0, float(np.min(room / np.maximum(high - low, 1e-6))))

    def flat(self, points: Array) -> Array:
        """Points (n, 3) in the picture (n, 2) [px], y downwards."""
        plane = np.column_stack([points @ self.right, points @ self.up]) - self.centre
        return np.asarray(np.array([WIDTH, HEIGHT]) / 2.0 + self.scale * plane * np.array([1.0, -1.0]))

    def depth(self, solid: Solid) -> float:
        """Distance behind the origin: the furthest is drawn first."""
        return -float(np.mean(np.concatenate([facet.corners for facet in solid]) @ self.towards))

    def visible(self, solid: Solid) -> Solid:
        """Facets whose outside the viewer sees, the silhouette first."""
        seen = [facet for facet in solid if facet.normal is None or float(facet.normal @ self.towards) > 0.0]
        return sorted(seen, key=lambda facet: facet.normal is not None)

    def polygon(self, facet: _Facet) -> str:
        """The facet, lighter where it faces the light."""
        points = _outline(self.flat(facet.corners))
        bright = 0.72 if facet.normal is None else 0.66 + 0.18 * float(facet.normal @ _LIGHT)
        red, green, blue = (round(255 * part) for part in colorsys.hls_to_rgb(facet.hue, bright, 0.32))
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        return f'<polygon points="{path}" fill="rgb({red},{green},{blue})" stroke="#45525e" stroke-width="0.6"/>'

    def axis(self, model: mujoco.MjModel, data: mujoco.MjData, joint: int) -> str:
        """A joint's name and its direction: an arrow along a slide, a dashed line about which a hinge turns."""
        slides = int(model.jnt_type[joint]) == int(mujoco.mjtJoint.mjJNT_SLIDE)
        anchor, direction = np.asarray(data.xanchor[joint]), np.asarray(data.xaxis[joint])
        reach = 62.0 / self.scale
        ends = self.flat(np.array([anchor - (0.0 if slides else 0.6 * reach) * direction, anchor + reach * direction]))
        (x1, y1), (x2, y2) = np.clip(ends, [4.0, 14.0], [WIDTH - 70.0, HEIGHT - 6.0])
        line = f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="{_ACCENT}" stroke-width="2"'
        head, dashes = (_arrow(np.array([x1, y1]), np.array([x2, y2])), "") if slides else ("", ' stroke-dasharray="6 4"')
        return (
            f"{line}{dashes}/>{head}"
            f'<text x="{x2 + 7:.1f}" y="{y2 + 1:.1f}" fill="{_ACCENT}" font-size="13">{escape(model.joint(joint).name)}</text>'
        )


def _arrow(start: Array, end: Array) -> str:
    along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    across = np.array([-along[1], along[0]])
    corners = (end + 5.0 * along, end - 5.0 * along + 5.0 * across, end - 5.0 * along - 5.0 * across)
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in corners)
    return f'<polygon points="{path}" fill="{_ACCENT}"/>'


def _body(model: mujoco.MjModel, data: mujoco.MjData, body: int) -> Iterator[Solid]:
    """A body's geoms, or its inertia where it has none."""
    hue = (0.57 + 0.11 * body) % 1.0
    first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
    geoms = [geom for geom in range(first, first + count) if int(model.geom_type[geom]) != int(mujoco.mjtGeom.mjGEOM_PLANE)]
    for geom in geoms:
        yield list(_geom(model, data, geom, hue))
    if not geoms and body > 0 and float(model.body_mass[body]) > 0.0:
        half = _inertia_box(model.body_inertia[body], float(model.body_mass[body]))
        yield list(_box(half, np.asarray(data.xipos[body]), np.asarray(data.ximat[body]).reshape(3, 3), hue))


def _inertia_box(inertia: Array, mass: float) -> Array:
    """Half sides (3,) [m] of the box of even density with these principal inertias [kg·m²]."""
    squares = 1.5 * (inertia.sum() - 2.0 * inertia) / mass
    return np.asarray(np.sqrt(np.maximum(squares, 1e-8)))


def _geom(model: mujoco.MjModel, data: mujoco.MjData, geom: int, hue: float) -> Iterator[_Facet]:
    kind, size = mujoco.mjtGeom(int(model.geom_type[geom])), np.asarray(model.geom_size[geom])
    place, turn = np.asarray(data.geom_xpos[geom]), np.asarray(data.geom_xmat[geom]).reshape(3, 3)
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        yield from _box(size, place, turn, hue)
    elif kind == mujoco.mjtGeom.mjGEOM_CYLINDER:
        yield from _cylinder(float(size[0]), float(size[1]), place, turn, hue)
    elif kind == mujoco.mjtGeom.mjGEOM_MESH:
        yield from _mesh(model, int(model.geom_dataid[geom]), place, turn, hue)
    else:
        yield _Facet(_rounded(kind, size) @ turn.T + place, None, hue)


def _box(half: Array, place: Array, turn: Array, hue: float) -> Iterator[_Facet]:
    square = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    for fixed in range(3):
        for side in (-1.0, 1.0):
            corners = np.insert(square, fixed, side, axis=1) * half
            yield _Facet(corners @ turn.T + place, side * turn[:, fixed], hue)


def _cylinder(radius: float, half: float, place: Array, turn: Array, hue: float) -> Iterator[_Facet]:
    ring = np.column_stack([np.cos(_AROUND), np.sin(_AROUND)]) * radius
    ends = [np.column_stack([ring, np.full(len(ring), side * half)]) for side in (-1.0, 1.0)]
    for end, side in zip(ends, (-1.0, 1.0), strict=True):
        yield _Facet(end @ turn.T + place, side * turn[:, 2], hue)
    yield _Facet(np.concatenate(ends) @ turn.T + place, None, hue)


def _mesh(model: mujoco.MjModel, mesh: int, place: Array, turn: Array, hue: float) -> Iterator[_Facet]:
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    corners = np.asarray(model.mesh_vert[first : first + count], dtype=np.float64) @ turn.T + place
    start, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    if faces > _FEW_FACES:
        yield _Facet(corners, None, hue)
        return
    for face in np.asarray(model.mesh_face[start : start + faces]):
        patch = corners[face]
        normal = np.cross(patch[1] - patch[0], patch[2] - patch[0])
        yield _Facet(patch, normal / max(float(np.linalg.norm(normal)), 1e-12), hue)


def _rounded(kind: mujoco.mjtGeom, size: Array) -> Array:
    """Points (n, 3) on a sphere, a capsule or an ellipsoid in its own frame; of any other geom, of its bounding ellipsoid."""
    steps = np.linspace(-np.pi / 2.0, np.pi / 2.0, 13)
    ball = np.array([[np.cos(a) * np.cos(b), np.cos(a) * np.sin(b), np.sin(a)] for a in steps for b in _AROUND])
    if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        return np.asarray(ball * size[0] + np.where(ball[:, 2:] > 0.0, 1.0, -1.0) * np.array([0.0, 0.0, size[1]]))
    radii = size if kind == mujoco.mjtGeom.mjGEOM_ELLIPSOID else np.full(3, size[0])
    return np.asarray(ball * radii)


def _outline(points: Array) -> Sequence[Array]:
    """The convex hull of points (n, 2), in order; two points where they lie on a line."""
    try:
        return [points[index] for index in ConvexHull(points).vertices]
    except QhullError:
        return [points[np.argmin(points[:, 0])], points[np.argmax(points[:, 0])]]
