"""However many threads there are, answers come in the order of what was asked, and are the same."""

from __future__ import annotations

import threading

import numba
import numpy as np
import pytest
from rig_bench import compared, strokes

from drivetwin.diagnosis.prepare.rows import Rows
from drivetwin.diagnosis.propose.side_by_side import by_key, side_by_side
from drivetwin.diagnosis.report.result import Array
from drivetwin.emulator.effects.backlash import Backlash
from drivetwin.foundation.errors import UserError

THREADS = [1, 3]


def with_threads(monkeypatch: pytest.MonkeyPatch, count: int) -> None:
    """As a process that was started with NUMBA_NUM_THREADS=count."""
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", count)


@pytest.mark.parametrize("count", THREADS)
def test_answers_come_in_the_order_of_what_was_asked(monkeypatch: pytest.MonkeyPatch, count: int) -> None:
    with_threads(monkeypatch, count)
    last_is_done = threading.Event()

    def squared(number: int) -> int:
        if number == 2:
            last_is_done.set()
        elif count > 1:
            assert last_is_done.wait(10.0)  # so that the first of three ends last
        return number**2

    assert side_by_side(squared, range(3)) == [0, 1, 4]


@pytest.mark.parametrize("count", THREADS)
def test_what_takes_longer_is_begun_first_and_the_order_stays(monkeypatch: pytest.MonkeyPatch, count: int) -> None:
    with_threads(monkeypatch, count)
    begun: list[int] = []

    def noted(number: int) -> int:
        begun.append(number)
        return number**2

    assert side_by_side(noted, range(4), lambda number: number == 3) == [0, 1, 4, 9]
    assert begun.index(3) < 3 if count > 1 else begun == [0, 1, 2, 3]
    assert by_key(noted, (2, 1)) == {2: 4, 1: 1}


@pytest.mark.parametrize("count", THREADS)
def test_the_first_failure_is_the_one_that_is_raised(monkeypatch: pytest.MonkeyPatch, count: int) -> None:
    with_threads(monkeypatch, count)

    def refused(number: int) -> int:
        if number > 1:
            raise UserError(f"no {number}")
        return number

    with pytest.raises(UserError, match="no 2"):
        side_by_side(refused, range(6), lambda number: number > 3)


def test_after_a_failure_no_other_is_begun(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else the process would end only when all that wait have been made."""
    with_threads(monkeypatch, 2)
    begun, failed = [], threading.Event()

    def refused(number: int) -> int:
        begun.append(number)
        if number == 0:
            raise UserError("no 0")
        assert failed.wait(10.0)
        return number

    with pytest.raises(UserError, match="no 0"):
        side_by_side(refused, range(20))
    failed.set()
    side_by_side(str, range(4))
    assert len(begun) <= 3


def test_one_thread_is_the_callers_own(monkeypatch: pytest.MonkeyPatch) -> None:
    with_threads(monkeypatch, 1)
    assert set(side_by_side(lambda _: threading.get_ident(), range(4))) == {threading.get_ident()}


def test_within_one_of_its_threads_it_stays_there(monkeypatch: pytest.MonkeyPatch) -> None:
    with_threads(monkeypatch, 2)

    def inner(_: int) -> tuple[int, set[int]]:
        return threading.get_ident(), set(side_by_side(lambda _: threading.get_ident(), range(4)))

    outer = side_by_side(inner, range(8))  # would wait for itself for ever with a pool of two that it fills
    assert all(used == {own} for own, used in outer)
    assert threading.get_ident() not in {own for own, _ in outer}


def test_a_single_item_needs_no_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    with_threads(monkeypatch, 2)
    assert side_by_side(lambda _: threading.get_ident(), [0]) == [threading.get_ident()]


def test_predictions_are_the_same_to_the_last_bit(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = []
    for count in THREADS:
        with_threads(monkeypatch, count)
        found.append(predicted(compared(tmp_path_factory.mktemp("rig"), strokes(1, 20.0))))
    assert len(found[0]) > 10
    np.testing.assert_array_equal(found[0], found[1])


def predicted(rows: Rows) -> list[Array]:
    """What every start of a search for backlash costs."""
    dynamics = rows.simulation.dynamics()["turn"]
    members = [member for start in Backlash.starts(rows.motion["turn"], dynamics) for member in start.members]
    return [column["turn"] for column in side_by_side(lambda member: rows.cost("turn", member, dynamics), members)]
