"""The collector stands still where time matters, and runs again afterwards."""

from __future__ import annotations

import gc

from drivetwin.foundation.collector import keep_for_good, without_collector


def test_it_stands_still_until_the_outermost_block_ends() -> None:
    assert gc.isenabled()
    with without_collector():
        with without_collector():
            assert not gc.isenabled()
        assert not gc.isenabled()
    assert gc.isenabled()


def test_it_runs_again_after_an_error() -> None:
    try:
        with without_collector():
            raise ZeroDivisionError
    except ZeroDivisionError:
        assert gc.isenabled()


def test_what_is_kept_for_good_is_not_looked_through() -> None:
    heap = [[number] for number in range(1000)]
    before = gc.get_freeze_count()
    try:
        keep_for_good()
        assert gc.get_freeze_count() > before + len(heap)
    finally:
        gc.unfreeze()
