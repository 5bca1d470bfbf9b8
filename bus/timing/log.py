"""A bus log as the frames of one wire: what `candump -L` and `drivetwin identify` write, or ASC, BLF, TRC."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import can

from drivetwin.bus.timing.frame_bits import Frame
from drivetwin.bus.timing.load import MICROSECONDS, LoggedFrame
from drivetwin.bus.timing.services import SYNC, service
from drivetwin.foundation.errors import UserError


@dataclass(frozen=True)
class Log:
    """Frames of one bus in the order of the file, and how many error frames it has, whose bits, and often bus, no log knows."""

    frames: tuple[LoggedFrame, ...]
    error_frames: int

    def from_first_sync(self) -> tuple[LoggedFrame, ...]:
        """The frames from the first SYNC on; all of them where there is none."""
        first = (place for place, logged in enumerate(self.frames) if service(logged.frame.identifier) == SYNC)
        return self.frames[next(first, 0) :]


def read_log(file: Path, channel: str | None = None) -> Log:
    """Read the frames of `channel`, or of the only one there is.

    Raises UserError where the file cannot be read as a log, has no frame of the channel, several channels and none is named,
    or frames that no classic CAN with 11-bit identifiers carries.
    """
    messages = list(_messages(file))
    sound = [message for message in messages if not message.is_error_frame]
    if not sound:
        raise UserError(f"{file} has no frames; give a log of candump -L, or the bus.log of drivetwin identify")
    frames = tuple(_logged(file, message) for message in _of_channel(file, sound, channel))
    return Log(frames, len(messages) - len(sound))


def _messages(file: Path) -> Iterator[can.Message]:
    try:
        with can.LogReader(str(file)) as reader:
            yield from reader
    except FileNotFoundError:
        raise UserError(f"{file} does not exist; give a bus log") from None
    except (OSError, ValueError, IndexError, struct.error) as error:
        raise UserError(
            f"{file} cannot be read as a bus log: {error}; candump logs are written with `candump -L` (or -l), "
            "others as .asc, .blf or .trc"
        ) from error


def _of_channel(file: Path, messages: Sequence[can.Message], channel: str | None) -> list[can.Message]:
    there = sorted({str(message.channel) for message in messages})
    if channel is None and len(there) > 1:
        raise UserError(f"{file} has frames of {', '.join(there)}; each is a wire of its own: name one with --channel")
    wire = [message for message in messages if channel is None or str(message.channel) == channel]
    if not wire:
        raise UserError(f"{file} has no frames of {channel}, only of {', '.join(there)}; name one of these with --channel")
    return wire


def _logged(file: Path, message: can.Message) -> LoggedFrame:
    if message.is_extended_id or message.is_fd:
        kind = "an FD frame" if message.is_fd else "a 29-bit identifier"
        raise UserError(
            f"{file}: {message.arbitration_id:X}h at {message.timestamp:.6f} s is {kind}; what is counted are classic frames "
            "with 11-bit identifiers: log with a filter, or another bus"
        )
    requested = message.dlc if message.is_remote_frame else None
    data = b"" if message.is_remote_frame else bytes(message.data)
    try:
        return LoggedFrame(round(message.timestamp * MICROSECONDS), Frame(message.arbitration_id, data, requested))
    except (ValueError, OverflowError) as error:
        raise UserError(f"{file}: no classic CAN frame at {message.timestamp:.6f} s: {error}") from None
