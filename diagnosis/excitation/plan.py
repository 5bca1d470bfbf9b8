"""The whole motion: every chosen excitation one after the other, at several poses of the other axes where those matter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.diagnosis.excitation.base import Excitation
from drivetwin.diagnosis.excitation.choice import Question, by_poses, chosen
from drivetwin.diagnosis.excitation.limits import AxisLimits
from drivetwin.diagnosis.excitation.path import PAUSE, Path, joined, move, stand
from drivetwin.foundation.errors import UserError

POSES = (0.5, 0.15, 0.85)
"""Shares of the travel at which the other axes stand."""


@dataclass(frozen=True)
class Passage:
    """One excitation in the whole motion: from `begin` to `end` [s], the other axes at `pose` [m or rad]."""

    excitation: Excitation
    begin: float
    end: float
    pose: Mapping[str, float]


@dataclass(frozen=True)
class Plan:
    """Set-points (n,) of every axis that moves, one a `period` [s], from rest to rest; what each passage is for."""

    question: Question
    period: float
    paths: Mapping[str, Path]
    passages: Sequence[Passage]
    limits: Mapping[str, AxisLimits]

    @property
    def time(self) -> NDArray[np.float64]:
        """Of the set-points (n,) [s]."""
        return np.arange(len(self.paths[self.question.axis]), dtype=np.float64) * self.period


def plan(question: Question, limits: Mapping[str, AxisLimits], period: float) -> Plan:
    """The motion that settles a question. Other axes move only for effects that depend on them, and only where limits let them.

    Raises UserError where the axis has no limits, or no motion settles the question.
    """
    axis = question.axis
    if axis not in limits:
        raise UserError(f"the limits have no axis {axis!r}; they have {', '.join(limits)}")
    others = {name: of for name, of in limits.items() if name != axis} if by_poses(question.effects) else {}
    excitations = chosen(question.effects)
    tracks: dict[str, list[Path]] = {name: [] for name in (axis, *others)}
    passages: list[Passage] = []
    for share in POSES if others else POSES[:1]:
        pose = {name: of.at(share) for name, of in others.items()}
        _go_to(tracks, pose, limits, period)
        for one in excitations:
            begin = _count(tracks[axis]) * period
            _append(tracks, axis, _continued(tracks[axis], one, limits[axis], period))
            passages.append(Passage(one, begin, _count(tracks[axis]) * period, pose))
    paths = {name: np.concatenate(track) for name, track in tracks.items()}
    return Plan(question, period, paths, tuple(passages), {name: limits[name] for name in paths})


def _continued(track: Sequence[Path], one: Excitation, limits: AxisLimits, period: float) -> Path:
    pieces = list(one.pieces(limits, period))
    before = [track[-1][-1:]] if track else []
    return joined([*before, *pieces], limits, period)


def _go_to(tracks: dict[str, list[Path]], pose: Mapping[str, float], limits: Mapping[str, AxisLimits], period: float) -> None:
    """Move the other axes to a pose, one after the other, while the axis in question rests."""
    for name, place in pose.items():
        if not tracks[name]:
            tracks[name].append(stand(place, PAUSE, period))
            continue
        _append(tracks, name, move(float(tracks[name][-1][-1]), place, limits[name].slower(0.5), period))


def _append(tracks: dict[str, list[Path]], moving: str, path: Path) -> None:
    """A path of one axis; whoever is behind then has stood where it was."""
    tracks[moving].append(path)
    longest = max(_count(track) for track in tracks.values())
    for track in tracks.values():
        if track and (behind := longest - _count(track)):
            track.append(np.full(behind, track[-1][-1]))


def _count(track: Sequence[Path]) -> int:
    return sum(len(path) for path in track)
