"""Joints that follow others: by MuJoCo's joint equalities, and by equalities of fixed tendons (belts, differentials).

A joint equality says q_1 = qpos0_1 + p(q_2 - qpos0_2), p of degree 4; q_1 = qpos0_1 + p(0) where it names no second joint.
One of tendons says the same of their lengths, which are sums of joint positions times coefficients (MuJoCo manual, equality).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from drivetwin.foundation.errors import UserError
from drivetwin.recording.recording import Samples


@dataclass(frozen=True)
class Follower:
    """Joint `joint` obeys q = qpos0 + p(d), d the sum of `weights` (m,) times how far the `leaders` are from their qpos0.

    `coefficients` of p, constant first, (5,).
    """

    joint: int
    leaders: tuple[int, ...]
    weights: Samples
    coefficients: Samples


@dataclass(frozen=True)
class Relation:
    """What an equality says of joints: the sum of shares times displacements is p(displacement of `argument`).

    A straight p is told by the shares and its constant, and then `argument` is None: any of the joints may follow the others.
    """

    name: str
    shares: Mapping[int, float]
    coefficients: Samples
    argument: int | None = None

    @property
    def joints(self) -> list[int]:
        """All that it ties together, the one that is to follow first."""
        return [*self.shares, *([] if self.argument is None else [self.argument])]

    def follower(self, joint: int) -> Follower | None:
        """The relation solved for one of its joints; None where that is the argument of a curve."""
        if self.argument is not None:
            return Follower(joint, (self.argument,), np.ones(1), self.coefficients) if joint in self.shares else None
        share = self.shares[joint]
        leaders = tuple(other for other in self.shares if other != joint)
        weights = np.array([-self.shares[other] / share for other in leaders])
        return Follower(joint, leaders, weights, np.array([self.coefficients[0] / share, 1.0, 0.0, 0.0, 0.0]))


def followers(mj: mujoco.MjModel, relations: Sequence[Relation], moved: Sequence[int]) -> list[Follower]:
    """Who follows where the joints `moved` are moved, in an order in which every leader comes before its followers.

    What nothing moves leads as it stands, at qpos0. Raises UserError for an equality that leaves more than one joint free.
    """
    moving, known = set(moved), set(moved)
    waiting = [one for one in relations if not known.issuperset(one.joints)]
    ordered: list[Follower] = []
    while waiting:
        ready = next((pair for pair in ((_ready(one, known), one) for one in waiting) if pair[0] is not None), None)
        if ready is None:
            _stand(mj, waiting[0], moving, known)
        else:
            follower, relation = ready
            assert follower is not None
            ordered.append(follower)
            known.add(follower.joint)
            if moving.intersection(follower.leaders):
                moving.add(follower.joint)
            waiting.remove(relation)
        waiting = [one for one in waiting if not known.issuperset(one.joints)]
    return ordered


def _ready(relation: Relation, known: set[int]) -> Follower | None:
    """The relation as a follower, where it has one joint that is not known."""
    unknown = [joint for joint in relation.joints if joint not in known]
    return relation.follower(unknown[0]) if len(unknown) == 1 else None


def _stand(mj: mujoco.MjModel, relation: Relation, moving: set[int], known: set[int]) -> None:
    """Nothing moves the joints of a relation: all but its first stand."""
    free = [joint for joint in relation.joints if joint not in known]
    if moving.intersection(relation.joints):
        names = ", ".join(mj.joint(joint).name or f"number {joint}" for joint in free)
        raise UserError(
            f"equality {relation.name} moves joints {names} with a recorded one and does not say how: record all but one of "
            "them, or give each its own joint equality"
        )
    known.update(free[1:])


def relations_of(mj: mujoco.MjModel) -> list[Relation]:
    """What the active equalities of a model say of joints; none where its options turn equalities off."""
    off = int(mujoco.mjtDisableBit.mjDSBL_EQUALITY) | int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    if int(mj.opt.disableflags) & off:
        return []
    kinds = {int(mujoco.mjtEq.mjEQ_JOINT): _of_joints, int(mujoco.mjtEq.mjEQ_TENDON): _of_tendons}
    active = [number for number in range(mj.neq) if int(mj.eq_type[number]) in kinds and mj.eq_active0[number]]
    return [relation for number in active if (relation := kinds[int(mj.eq_type[number])](mj, number)).joints]


def _of_joints(mj: mujoco.MjModel, number: int) -> Relation:
    first, second = int(mj.eq_obj1id[number]), int(mj.eq_obj2id[number])
    coefficients = mj.eq_data[number, :5].copy()
    name = mj.equality(number).name or f"of joint {mj.joint(first).name}"
    if second < 0:
        return Relation(name, {first: 1.0}, coefficients)
    if coefficients[2:].any() or not coefficients[1]:
        return Relation(name, {first: 1.0}, coefficients, argument=second)
    return Relation(name, {first: 1.0, second: -coefficients[1]}, coefficients)


def _of_tendons(mj: mujoco.MjModel, number: int) -> Relation:
    """Without joints where the tendons have no straight law: those are none that a joint follows."""
    first, second = int(mj.eq_obj1id[number]), int(mj.eq_obj2id[number])
    coefficients = mj.eq_data[number, :5].copy()
    name = mj.equality(number).name or f"of tendon {mj.tendon(first).name}"
    fixed = [int(mj.tendon_type[each]) == int(mujoco.mjtTendon.mjTENDON_FIXED) for each in (first, second) if each >= 0]
    if not all(fixed) or (second >= 0 and coefficients[2:].any()):
        return Relation(name, {}, coefficients)
    shares = _joints_of(mj, first)
    if second >= 0:
        for joint, share in _joints_of(mj, second).items():
            shares[joint] = shares.get(joint, 0.0) - coefficients[1] * share
    return Relation(name, {joint: share for joint, share in shares.items() if share}, coefficients)


def _joints_of(mj: mujoco.MjModel, tendon: int) -> dict[int, float]:
    """Coefficients of a fixed tendon by joint."""
    shares: dict[int, float] = {}
    for place in range(int(mj.tendon_adr[tendon]), int(mj.tendon_adr[tendon] + mj.tendon_num[tendon])):
        joint = int(mj.wrap_objid[place])
        shares[joint] = shares.get(joint, 0.0) + float(mj.wrap_prm[place])
    return shares
