"""Performs one task on a bus completely: from powered drives to disabled drives."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import can

from drivetwin.controller.limits import Limits
from drivetwin.controller.outcome import Ending, Outcome
from drivetwin.controller.pacing import Pacing
from drivetwin.controller.progress import Progress
from drivetwin.controller.session import MOST_LOAD, Streaming, machine_on, roomy
from drivetwin.controller.tasks.base import Work
from drivetwin.controller.tasks.file import Order
from drivetwin.controller.trouble import TroubleError
from drivetwin.foundation.errors import InterruptedByUserError, UserError


@dataclass(frozen=True)
class Place:
    """Where an order is done: the bus, its clock, what the axes may do, where results and the bus log go."""

    bus: can.BusABC
    pacing: Pacing
    limits: Limits | None
    out: Path
    log: Path | None


def perform(order: Order, place: Place) -> Outcome:
    """Do it; an error before the machine was brought up is a refusal, one afterwards a stop.

    Raises InterruptedByUserError after a Ctrl-C, with every axis stopped.
    """
    streaming, reason = _streaming(order)
    so_far = Outcome(Ending.REFUSED, cycle=streaming.period, cycle_reason=reason)
    work: Work | None = None
    try:
        with machine_on(
            place.bus, order.machine, order.profile, place.pacing, place.limits, Progress(), place.log, streaming
        ) as session:
            work = Work(session, place.out, order.seed, order.resume)
            order.task.run(work)
    except InterruptedByUserError:
        raise
    except UserError as error:
        node, emcy = (error.node, error.emcy) if isinstance(error, TroubleError) else (None, None)
        ended = replace(so_far, reason=str(error), node=node, emcy=emcy)
        return ended if work is None else _counted(replace(ended, ending=Ending.STOPPED), work)
    return _counted(replace(so_far, ending=Ending.DONE), work)


def _streaming(order: Order) -> tuple[Streaming, str]:
    """What is streamed, at the asked cycle or the shortest longer one that leaves room on the bus, and why."""
    asked, axes = Streaming(order.cycle), len(order.machine.axes)
    chosen = roomy(asked, axes)
    if chosen.period == asked.period:
        return chosen, ""
    taken = 100.0 * asked.bus_time(axes) / asked.period
    return chosen, (
        f"the PDOs of {axes} axes take {taken:.0f} % of 1 Mbit/s in the {asked.period * 1e3:g} ms requested, with "
        f"worst-case stuffing, and {100.0 * MOST_LOAD:.0f} % is the most: the cycle is {chosen.period * 1e3:g} ms"
    )


def _counted(outcome: Outcome, work: Work) -> Outcome:
    return replace(outcome, missed=work.session.cycle.missed, recoveries=work.recoveries)
