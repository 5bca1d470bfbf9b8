"""`drivetwin bus-load`: the load that the frames of a log make on a physical bus, and whether it is too much."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Annotated

import typer
from rich import box
from rich.console import Console
from rich.table import Table

from drivetwin.bus.timing.bit_rate import read_bit_rate
from drivetwin.bus.timing.load import Load, Overruns, Window
from drivetwin.bus.timing.log import Log, read_log
from drivetwin.bus.timing.services import AT_LEISURE
from drivetwin.cli.terminal import AsJson
from drivetwin.foundation.errors import UserError

MOST_LOAD = 0.8
"""Share of the wire beyond which a bus counts as too full: the rest is for what nobody has planned."""

console = Console(width=max(100, Console().width))


def bus_load_command(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A log of candump -L, or .asc, .blf, .trc.", show_default=False)],
    bit_rate: Annotated[str, typer.Option(help="Bit rate of the bus: 1M, 500k, 250k, 125k.")] = "1M",
    window: Annotated[str, typer.Option(help="Length of the window that slides along the log: 100ms, 1s.")] = "100ms",
    channel: Annotated[str | None, typer.Option(help="The interface, if the log has several: vcan0.")] = None,
    json_: AsJson = False,
) -> None:
    """Compute the load of a physical bus from a log: mean, worst window, by service, and whether the frames would fit.

    Counts the bits of each frame with its actual stuff bits, from the first SYNC of the log on. Before it, drives are
    configured, one request at a time, at any pace.

    Example: drivetwin bus-load out/identify/bus.log --bit-rate 1M
    """
    rate, length = read_bit_rate(bit_rate), _seconds(window)
    read = read_log(log, channel)
    load = _load(log, read)
    whole, worst, overruns = load.whole(), load.worst(length), load.overruns(rate)
    if length > whole.length:
        raise UserError(f"--window {window} is longer than {log}, which has {whole.length:.3g} s from its first SYNC on")
    if json_:
        print(json.dumps(_figures(rate, whole, worst, overruns), indent=1))
        return
    console.print(_table(log, rate, whole, worst))
    for line in [*_notes(read, whole), *_without_waiting(rate, load, worst), _verdict(rate, worst, overruns)]:
        console.print(line, highlight=False, soft_wrap=True)


def _figures(rate: int, whole: Window, worst: Window, overruns: Overruns | None) -> dict[str, object]:
    """What the table and the verdict say, for a program."""
    return {
        "bit_rate": rate,
        "fits": not _too_much(rate, worst, overruns),
        "mean": _window(rate, whole),
        "worst": _window(rate, worst),
        "cycles": None if overruns is None else vars(overruns),
    }


def _window(rate: int, window: Window) -> dict[str, object]:
    return {
        "start": window.start,
        "length": window.length,
        "load": window.load(rate),
        "bits": window.bits,
        "bits_by_service": window.by_service,
    }


def _seconds(text: str) -> float:
    factors = {"ms": 1e-3, "s": 1.0}
    found = re.fullmatch(r"(\d+(?:\.\d+)?)(ms|s)", text)
    seconds = float(found[1]) * factors[found[2]] if found else 0.0
    if seconds < 1e-3:
        raise UserError(f"--window {text} is not a time of 1ms or more; write for example 100ms or 1s")
    return seconds


def _load(log: Path, read: Log) -> Load:
    try:
        return Load(read.from_first_sync())
    except ValueError as error:
        raise UserError(f"{log}: {error}") from None


def _table(log: Path, bit_rate: int, whole: Window, worst: Window) -> Table:
    title = f"{log} on a physical bus of {bit_rate / 1000:g} kbit/s"
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    table.add_column("service", no_wrap=True)
    worst_head = f"worst {1e3 * worst.length:g} ms"
    for name in ("bits", "mean load", f"bits in the {worst_head}", "load"):
        table.add_column(name, justify="right", no_wrap=True)
    for name, bits in sorted(whole.by_service.items(), key=lambda entry: -entry[1]):
        table.add_row(name, *_cells(bits, whole, bit_rate), *_cells(worst.by_service.get(name, 0), worst, bit_rate))
    table.add_section()
    table.add_row("all", *_cells(whole.bits, whole, bit_rate), *_cells(worst.bits, worst, bit_rate))
    return table


def _cells(bits: int, window: Window, bit_rate: int) -> list[str]:
    return [str(bits), f"{100.0 * bits / (bit_rate * window.length):.2f} %"]


def _notes(read: Log, whole: Window) -> list[str]:
    notes = []
    before = len(read.frames) - whole.frames
    if before:
        notes.append(f"{before} frames before the first SYNC are not counted")
    if read.error_frames:
        notes.append(f"{read.error_frames} error frames are not counted: how long each held the wire is in no log")
    return notes


def _without_waiting(bit_rate: int, load: Load, worst: Window) -> list[str]:
    """What is left where the worst window has SDO, which takes no time on a clock that only SYNC moves."""
    if AT_LEISURE.isdisjoint(worst.by_service):
        return []
    cyclic = load.worst(worst.length, without=AT_LEISURE)
    return [f"without SDO, NMT and LSS, which wait for their turn: {_full(bit_rate, cyclic)}"]


def _full(bit_rate: int, window: Window) -> str:
    return f"{100.0 * window.load(bit_rate):.1f} % in the {1e3 * window.length:g} ms from {window.start:.6f} s"


def _too_much(bit_rate: int, worst: Window, overruns: Overruns | None) -> list[str]:
    """Why these frames would not fit; nothing where they would."""
    reasons = []
    if worst.load(bit_rate) >= MOST_LOAD:
        reasons.append(f"{_full(bit_rate, worst)}, {100.0 * MOST_LOAD:g} % or more")
    if overruns is not None and overruns.overrun:
        reasons.append(
            f"{overruns.overrun} of {overruns.cycles} cycles of {1e3 * overruns.period:g} ms end late, that of the SYNC at "
            f"{overruns.at:.6f} s by {1e3 * overruns.latest:.3f} ms"
        )
    return reasons


def _verdict(bit_rate: int, worst: Window, overruns: Overruns | None) -> str:
    reasons = _too_much(bit_rate, worst, overruns)
    if reasons:
        return f"would not fit: {'; '.join(reasons)}"
    in_time = "" if overruns is None else f", and all {overruns.cycles} cycles of {1e3 * overruns.period:g} ms end in time"
    return f"would fit: {_full(bit_rate, worst)}, below {100.0 * MOST_LOAD:g} %{in_time}"
