"""The scope of a panel, one instrument that every page sees alike: channels, trigger, what is held."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from drivetwin.foundation.control_socket import ask_control
from drivetwin.foundation.errors import UserError
from drivetwin.panel.bus_time import BusTime
from drivetwin.panel.node_watch import POSITION, NodeWatch
from drivetwin.panel.pdo_reading import Address
from drivetwin.panel.power_states import PowerState
from drivetwin.panel.scope.channel import AnyChannel, ObjectChannel, TruthChannel, read_channel
from drivetwin.panel.scope.picture import COLUMNS, Span, envelope, packed, pairs, told
from drivetwin.panel.scope.ring import Ring, Samples
from drivetwin.panel.scope.trigger import Trigger

MOST_CHANNELS = 12

WINDOWS = (0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0)
"""Lengths of what the screen shows [s]."""

ASK_EVERY = 0.02
"""Pause between two rounds of questions for what no PDO brings [s]."""

LOOKED_AT = 2.0
"""So long after a page was told the scope counts as looked at [s]."""

STATUSWORD_INDEX = 0x6041

Trace = tuple[Samples, Samples]
"""Times [s] and shown values of a channel."""


@dataclass(frozen=True)
class Settings:
    """What the screen shows. `pre` is the share of `window` [s] before the trigger; `xy` are the keys of two channels."""

    channels: tuple[AnyChannel, ...]
    window: float = 5.0
    pre: float = 0.2
    trigger: Trigger | None = None
    xy: tuple[str, str] | None = None


@dataclass(frozen=True)
class Held:
    """What stays on the screen: traces by key, and when the trigger fired, None where somebody pressed stop."""

    span: Span
    traces: dict[str, Trace]
    fired: float | None


class Scope:
    """`take` and `settle` are for the thread of the bus, `ask_round` for the one that asks, all else for that of the pages."""

    def __init__(self, nodes: Mapping[int, NodeWatch], bus_time: BusTime, control: Path | None) -> None:
        self._nodes = dict(nodes)
        self._time = bus_time
        self._control = control
        self._lock = threading.Lock()
        self._looked_at = 0.0
        self._notes: dict[str, str] = {}
        self._rings: dict[str, Ring] = {}
        self._keys: dict[tuple[int, Address], str] = {}
        self._fired: float | None = None
        self._armed = False
        self.held: Held | None = None
        shown = [f"{node.node_id}:6064:00" for node in nodes.values() if POSITION in node.entries]
        self.settings = Settings(())
        self.set(shown[:MOST_CHANNELS], 5.0, 0.2, None, None)
        for node in nodes.values():
            node.hearers.append(self.take)

    def set(self, keys: list[str], window: float, pre: float, trigger: Trigger | None, xy: tuple[str, str] | None) -> None:
        """Show these channels; what has been kept of one that stays is kept. Raises UserError."""
        if len(keys) > MOST_CHANNELS:
            raise UserError(f"{len(keys)} channels; a scope has {MOST_CHANNELS} at most")
        if window not in WINDOWS or not 0.0 <= pre <= 0.9:
            raise UserError(f"window {window:g} s, pre-trigger {pre:g}; expected one of {WINDOWS} s, and 0 to 0.9 of it")
        channels = {key: read_channel(key, self._nodes, truth=self._control is not None) for key in keys}
        for named in (*(xy or ()), *([trigger.channel] if trigger else [])):
            if named not in channels:
                raise UserError(f"{named} is not among the channels that are shown; add it first")
        _check(trigger, channels)
        with self._lock:
            self.settings = Settings(tuple(channels.values()), window, pre, trigger, xy)
            self._rings = {key: self._rings.get(key) or Ring() for key in channels}
            self._keys = {
                (one.node.node_id, one.address): key for key, one in channels.items() if isinstance(one, ObjectChannel)
            }
            self._notes = {}
            self._run()

    def run(self, runs: bool) -> None:
        """Run, and wait for the trigger if there is one; or stop and hold what the screen shows."""
        with self._lock:
            if runs:
                self._run()
            elif self.held is None:
                self.held = self._hold(Span(self._time.now - self.settings.window, self._time.now), None)

    def take(self, node_id: int, address: Address, times: Samples, values: Samples) -> None:
        """Values of a drive, whatever brought them."""
        if (key := self._keys.get((node_id, address))) is not None:
            self.keep(key, times, values)

    def keep(self, key: str, times: Samples, values: Samples) -> None:
        """Samples of a channel (n,) [s]."""
        with self._lock:
            if (ring := self._rings.get(key)) is None:
                return
            before = ring.last
            ring.extend(times, values)
            if self._armed and (place := self._fires(key, before, values)) is not None:
                self._armed, self._fired = False, float(times[place])

    def settle(self) -> None:
        """All that has passed by now is kept; what the trigger waits for may be complete."""
        with self._lock:
            if self._fired is not None and self.held is None:
                self._complete(self._fired)

    def ask_round(self) -> None:
        """Ask once for each channel that no PDO brings, while a page looks and where no other master asks that drive."""
        if time.monotonic() - self._looked_at > LOOKED_AT:
            return
        for channel in self.settings.channels:
            if isinstance(channel, ObjectChannel) and channel.source == "SDO" and channel.node.settled:
                self._noted(channel.key, partial(channel.node.ask, channel.address))
        truths = [channel for channel in self.settings.channels if isinstance(channel, TruthChannel)]
        if truths:
            self._noted(truths[0].key, partial(self._ask_truth, truths))

    def _ask_truth(self, channels: list[TruthChannel]) -> None:
        if self._control is None:
            return
        axes = ask_control(self._control, {"truth": {}})["axes"]
        for channel in channels:
            self.keep(channel.key, np.array([self._time.now]), np.array([float(axes[channel.axis][channel.quantity])]))

    def _noted(self, key: str, ask: Callable[[], object]) -> None:
        """Ask, and keep in words why nothing came."""
        try:
            ask()
        except UserError as error:
            self._notes[key] = str(error)
        else:
            self._notes.pop(key, None)

    def _run(self) -> None:
        self.held, self._fired = None, None
        self._armed = self.settings.trigger is not None

    def _fires(self, key: str, before: float | None, values: Samples) -> int | None:
        """The place of the value at which the trigger fires."""
        trigger = self.settings.trigger
        if trigger is None or trigger.channel != key:
            return None
        scale = next(channel.scale for channel in self.settings.channels if channel.key == key)
        first = values[0] if before is None else before
        place = trigger.fires(np.concatenate([[first], values]) * scale)
        return None if place is None else place - 1

    def _complete(self, fired: float) -> None:
        start = fired - self.settings.pre * self.settings.window
        if self._time.now >= start + self.settings.window:
            self.held = self._hold(Span(start, start + self.settings.window), fired)

    def _hold(self, span: Span, fired: float | None) -> Held:
        traces = {key: (times.copy(), values) for key, (times, values) in self._traces(span).items()}
        return Held(span, traces, fired)

    def _traces(self, span: Span) -> dict[str, Trace]:
        """Times where they stand in the rings, so with the lock held as long as they are used."""
        return {channel.key: self._trace(channel, span) for channel in self.settings.channels}

    def _trace(self, channel: AnyChannel, span: Span) -> Trace:
        times, values = self._rings[channel.key].between(span.start, span.end)
        return times, values * channel.scale

    def shown(self) -> Held:
        """What is held, else what the screen shows now."""
        with self._lock:
            now = self._time.now
            return self.held or self._hold(Span(now - self.settings.window, now), None)

    def _drawn(self) -> tuple[dict[str, object], dict[str, object] | None, float | None]:
        """What the screen shows now, as `picture` and `_xy` tell it, and when the trigger fired [s]."""
        with self._lock:
            if self.held is not None:
                return self.picture(self.held, self.held.span), self._xy(self.held), self.held.fired
            span = Span(self._time.now - self.settings.window, self._time.now)
            shown = Held(span, self._traces(span), None)
            return self.picture(shown, span), self._xy(shown), None

    @property
    def state(self) -> str:
        """In a word: what it does."""
        if self.held is not None:
            return "stopped" if self.held.fired is None else "triggered"
        if self.settings.trigger is None:
            return "runs"
        return "waits for the trigger" if self._armed else "triggered, fills the window"

    def told(self) -> dict[str, object]:
        """For the page."""
        self._looked_at = time.monotonic()
        settings = self.settings
        picture, over, fired = self._drawn()
        return {
            "nodes": [{"id": node.node_id, "name": node.name} for node in self._nodes.values()],
            "truths": [node.axis.name for node in self._nodes.values() if node.axis and self._control],
            "states": [str(state) for state in PowerState],
            "windows": WINDOWS,
            "most": MOST_CHANNELS,
            "state": self.state,
            "set": {
                "channels": [channel.key for channel in settings.channels],
                "window": settings.window,
                "pre": settings.pre,
                "trigger": None if settings.trigger is None else vars(settings.trigger),
                "xy": settings.xy,
            },
            "channels": [self._told(channel) for channel in settings.channels],
            "fired": fired,
            "picture": picture,
            "xy": over,
        }

    def picture(self, shown: Held, span: Span) -> dict[str, object]:
        """What a screen can show of a span [s] of it: smallest and largest values of each channel, two a column."""
        values = {key: packed(envelope(*trace, span)) for key, trace in shown.traces.items()}
        return {"start": span.start, "end": span.end, "points": 2 * COLUMNS, "values": values}

    def _told(self, channel: AnyChannel) -> dict[str, object]:
        ring = self._rings.get(channel.key)
        last = None if ring is None or ring.last is None else ring.last * channel.scale
        note = self._notes.get(channel.key, "")
        said = {"label": channel.label, "unit": channel.unit, "source": channel.source}
        return {"key": channel.key, **said, "last": last, "note": note}

    def _xy(self, shown: Held) -> dict[str, object] | None:
        if self.settings.xy is None:
            return None
        with suppress(KeyError):  # another page has taken the channel away meanwhile
            x, y = pairs(*(shown.traces[key] for key in self.settings.xy))
            return {"x": told(x), "y": told(y)}
        return None


def _check(trigger: Trigger | None, channels: dict[str, AnyChannel]) -> None:
    """Raises UserError for a state that the trigger's channel does not tell."""
    if trigger is None or trigger.kind != "state":
        return
    channel = channels[trigger.channel]
    if not isinstance(channel, ObjectChannel) or channel.address[0] != STATUSWORD_INDEX:
        raise UserError(f"{trigger.channel} has no states; trigger on a channel of the statusword (6041h)")
    if trigger.state not in list(PowerState):
        raise UserError(f"unknown state {trigger.state!r}; known are {', '.join(PowerState)}")
