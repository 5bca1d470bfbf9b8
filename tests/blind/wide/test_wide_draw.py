"""Cases of the wide generator: the same for a seed, of what was asked for, written as the contract says, without truth."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from itertools import islice
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from repeats import LONG

from drivetwin.blind.key import seal
from drivetwin.blind.wide.case import Item, WideCase
from drivetwin.blind.wide.choice import SHARES, choice, plans
from drivetwin.blind.wide.draw import draw_wide, each_wide, world_of
from drivetwin.blind.wide.drives import LAWS, draw_drive
from drivetwin.blind.wide.families import FAMILIES
from drivetwin.blind.wide.record import record_wide
from drivetwin.foundation.errors import UserError
from drivetwin.recording.reader import read_recording
from drivetwin.recording.recording import COLUMNS

ONLY = ("linear", "pendulum", "stribeck", "coulomb_asymmetry", "foreign:fan")
COUNT = 4 if LONG else 2
RECORDINGS = ("train_1", "train_2", "train_3", "validate_1", "validate_2")


@pytest.fixture(scope="module")
def cases() -> tuple[WideCase, ...]:
    return draw_wide(COUNT, 5, choice(ONLY))


@pytest.fixture(scope="module")
def folder(cases: tuple[WideCase, ...], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first case with a cause, written."""
    written = tmp_path_factory.mktemp("wide") / "case"
    record_wide(with_cause(cases), written)
    return written


def with_cause(cases: tuple[WideCase, ...]) -> WideCase:
    return next(case for case in cases if case.causes)


def test_a_seed_draws_the_same_cases(cases: tuple[WideCase, ...]) -> None:
    again = tuple(islice(each_wide(COUNT, 5, choice(ONLY)), COUNT // 2))
    assert seal(again, 5) == seal(cases[: COUNT // 2], 5)
    assert [asdict(case) for case in again] == [asdict(case) for case in cases[: COUNT // 2]]


def test_a_case_is_recorded_to_the_same_samples(cases: tuple[WideCase, ...], folder: Path, tmp_path: Path) -> None:
    record_wide(with_cause(cases), tmp_path / "again")
    for name in RECORDINGS:
        first, second = (pq.read_table(where / name / "signals.parquet") for where in (folder, tmp_path / "again"))
        assert first.equals(second)


def test_only_what_is_asked_for_is_drawn(cases: tuple[WideCase, ...]) -> None:
    assert {case.machine for case in cases} <= {"linear", "pendulum"}
    assert {cause.effect for case in cases for cause in case.causes} <= set(ONLY)


@pytest.mark.parametrize("law", LAWS)
def test_a_drive_in_torque_mode_and_one_of_untold_law_have_no_demand_to_compare_with(law: str) -> None:
    """Nobody could find there that a drive gives another torque than was asked for."""
    assert draw_drive(np.random.default_rng(1), law).demand_is_recorded == (law not in ("torque", "untold"))


def test_names_keep_and_leave_out_kinds_of_their_group() -> None:
    allowed = choice(["arm6", "stribeck", "delay"], without=["delay"])
    assert (allowed.families, allowed.effects) == (("arm6",), ("stribeck",))
    assert len(allowed.foreign) > 5
    assert set(choice(without=["arm7"]).families) == set(FAMILIES) - {"arm7"}


@pytest.mark.parametrize(("only", "without"), [(["gearbox"], []), ([], ["gearbox"]), (["arm6"], ["arm6"]), (["robots"], [])])
def test_names_that_mean_nothing_are_refused(only: list[str], without: list[str]) -> None:
    with pytest.raises(UserError):
        choice(only, without)


def test_kinds_have_their_shares() -> None:
    drawn = plans(np.random.default_rng(0), 100, choice())
    kinds = [kind for kind, _ in drawn]
    assert {kind: kinds.count(kind) for kind in SHARES} == {kind: round(100 * share) for kind, share in SHARES.items()}
    assert kinds.count("single") == 50
    assert {len(effects) for kind, effects in drawn if kind == "four"} == {4}


def items(case: WideCase) -> list[Item]:
    """The causes of a case, as this generator draws them: with size and share."""
    found = [cause for cause in case.causes if isinstance(cause, Item)]
    assert len(found) == len(case.causes)
    return found


def test_machines_of_one_axis_have_what_one_axis_can_have() -> None:
    one_axis = ("rotary", "pendulum", "linear", "lift")
    allowed = choice(one_axis)
    assert set(choice().effects) - set(allowed.effects) == {"coupling"}, "with what, without another axis"
    planned = plans(np.random.default_rng(0), 64, allowed)
    assert len(planned) == 64
    assert "four" not in {kind for kind, _ in planned}
    assert "four" in {kind for kind, _ in plans(np.random.default_rng(0), 64, choice(("scara",)))}
    with pytest.raises(UserError, match="no machine of linear can have gravity; allow more families"):
        choice(("linear", "gravity"))


def test_sizes_and_shares_are_told(cases: tuple[WideCase, ...]) -> None:
    for case in cases:
        for cause in items(case):
            assert 0.003 < cause.size < 0.6
            assert 0.0 < cause.share <= 1.0
        assert 2 <= len(case.beside) <= 4
        assert {item.axis for item in case.nuisances if item.effect == "presliding"} == set(case.axes)
        if case.kind == "clean":
            assert all(level.gap <= 0.51 * level.noise for level in case.levels.values())


def test_nuisances_are_small_beside_the_cause_along_the_recorded_motion(cases: tuple[WideCase, ...]) -> None:
    """2 to 10 % of its energy, and never more than 20 %: the machine moves otherwise with them than without."""
    for case in cases:
        largest = max((cause.size for cause in items(case)), default=np.inf)
        assert all(item.size**2 <= 0.21 * largest**2 for item in case.beside)


def test_recordings_keep_to_the_contract(folder: Path) -> None:
    for name in RECORDINGS:
        (recording,) = read_recording(folder / name)
        assert recording.time[0] == 0.0
        for named in recording.columns.values():
            assert {"torque", "position"} <= set(named) <= set(COLUMNS)
            assert all(np.isfinite(values).all() for values in named.values())


def test_torque_and_position_are_in_whole_steps(folder: Path) -> None:
    (recording,) = read_recording(folder / "train_1")
    for axis, info in recording.info.axes.items():
        for name, step in (("torque", info.torque_resolution), ("position", info.position_resolution)):
            assert step is not None
            steps = recording.columns[axis][name] / step
            assert np.abs(steps - np.round(steps)).max() < 1e-3


def test_nothing_of_the_truth_is_in_a_case(cases: tuple[WideCase, ...], folder: Path) -> None:
    """No file says an effect's name or one of its values; the torque's timing is told, as the maker of a drive may do."""
    case = with_cause(cases)
    told = "\n".join(path.read_text(encoding="utf-8") for path in sorted(folder.rglob("*")) if path.suffix in (".json", ".xml"))
    files = {path.name for path in folder.rglob("*") if path.is_file() and not path.name.startswith(".")}
    assert files == {"model.xml", "model_off.xml", "recording.json", "signals.parquet"}
    physical = [item for item in case.items if item.effect not in ("torque_lag", "torque_lowpass", "out_of_step")]
    secrets = {str(case.seed), case.machine, *case.friction, *(item.effect for item in case.items)} - {"coulomb"}
    secrets |= {repr(value) for item in physical for value in item.parameters.values() if value != round(value)}
    assert [secret for secret in sorted(secrets) if f'"{secret}"' in told or f" {secret}" in told] == []
    for name in RECORDINGS:
        assert pq.read_schema(folder / name / "signals.parquet").metadata is None
        assert json.loads((folder / name / "recording.json").read_text(encoding="utf-8"))["seed"] == 0


def test_clean_machines_noise_is_part_of_their_world(cases: tuple[WideCase, ...]) -> None:
    case = with_cause(cases)
    noisier = replace(case, noise=tuple(1.0 for _ in case.axes))
    before, after = (world_of(one, None).channels[0].torque_noise for one in (case, noisier))
    assert after == pytest.approx(before - case.noise[0] + 1.0)
