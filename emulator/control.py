"""The control socket: injects faults into a running virtual machine, one JSON object per line.

    {"strike": {"fault": "sto", "node": 2}, "for": 0.5}     `for` [s] may be left out: until it is ended
    {"end": {"fault": "sto", "node": 2}}

    {"list": {}}                                            every fault there is, with its parameters
    {"truth": {}}                                           what the axes truly do, for the emulator's owner
    {"parameters": {}}                                      their true inertia and friction, for the same
    {"read": {"node": 2, "index": 24641, "subindex": 0}}    an object of a drive, as by its service port
    {"write": {..., "data": "2700"}}                        its bytes, in hexadecimal

The answer is {"fault": NAME, "time": SIMULATED SECONDS}, or {"error": MESSAGE}; to the list
{"faults": {NAME: ...}} as of `drivetwin fault --list --json`, to the truth
{"time": SIMULATED SECONDS, "axes": {AXIS: {"position": rad or m, "velocity": rad/s or m/s, "torque": the motor's, N·m or N}}},
on the joint side; to the parameters {"axes": {AXIS: {NAME: NUMBER}}} as `Plant.truth` has them; to an object
{"data": HEXADECIMAL BYTES}, or {"refused": MESSAGE} by CiA 301's abort codes.
"""

from __future__ import annotations

import json
import logging
import os
import selectors
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from drivetwin.emulator.canopen.alarms import Alarm
from drivetwin.emulator.faults.base import Fault, LastingFault
from drivetwin.emulator.faults.library import described, library, read_fault
from drivetwin.emulator.faults.parameter import ALL, Number
from drivetwin.emulator.service_port import read_object, write_object
from drivetwin.emulator.virtual_machine import VirtualMachine
from drivetwin.foundation.errors import UserError

DURATION = Number("for", "how long it lasts, in simulated time", "s", 0.0, 1e6)

logger = logging.getLogger(__name__)

LONGEST_LINE = 4096
MOST_CONVERSATIONS = 32
"""At once; a connection beyond them is closed."""

OWNER_ONLY = 0o177
"""Mask that leaves a socket to read and write for its owner alone."""


class Control:
    """Strikes and ends faults of one virtual machine as its lines say."""

    def __init__(self, virtual: VirtualMachine) -> None:
        self._virtual = virtual
        self._endings: dict[Fault, Alarm] = {}
        self._there: set[tuple[Fault, int]] = set()

    def answer(self, line: bytes) -> bytes:
        """The answer to a line, a line too."""
        try:
            return _line(self._answer(_request(line)))
        except UserError as error:
            return _line({"error": str(error)})

    def _answer(self, request: dict[str, Any]) -> dict[str, object]:
        if request == {"list": {}}:
            return {"faults": {kind.name: described(kind) for kind in library().values()}}
        if request == {"truth": {}}:
            return {"time": self._virtual.now(), "axes": self._truth()}
        if request == {"parameters": {}}:
            return {"axes": self._virtual.plant.truth()}
        match request:
            case {"read": dict(told), **rest} if not rest:
                return read_object(self._virtual, told)
            case {"write": dict(told), **rest} if not rest:
                return write_object(self._virtual, told)
        return {"fault": self._obey(request).name, "time": self._virtual.now()}

    def _truth(self) -> dict[str, object]:
        plant, axes = self._virtual.plant, self._virtual.machine.axes
        each = zip(axes.items(), plant.joint_positions(), plant.joint_velocities(), plant.motor_torque, strict=True)
        return {
            name: {"position": float(position), "velocity": float(velocity), "torque": float(torque * axis.gear_ratio)}
            for (name, axis), position, velocity, torque in each
        }

    def _obey(self, request: dict[str, Any]) -> Fault:
        match request:
            case {"strike": dict(told), **rest} if set(rest) <= {"for"}:
                return self._strike(read_fault(told), rest.get("for"))
            case {"end": dict(told), **rest} if not rest:
                fault = read_fault(told)
                self._refuse_unless_there(fault)
                self._end(fault)
                return fault
        raise UserError(
            'expected {"strike": FAULT, "for": SECONDS}, {"end": FAULT}, {"list": {}}, {"truth": {}}, {"parameters": {}}, '
            '{"read": OBJECT} or {"write": OBJECT}; '
            'FAULT: {"fault": "sto", "node": 2}'
        )

    def _refuse_unless_there(self, fault: Fault) -> None:
        """Raises UserError for a fault that has an end and that nobody struck, or that has ended."""
        if isinstance(fault, LastingFault) and not self._there & self._struck(fault):
            there = ", ".join(sorted({f"{one.name} on axis {self._axis(axis)}" for one, axis in self._there}))
            raise UserError(f"there is no active {fault.name} with these parameters to end; there is {there or 'none'}")

    def _struck(self, fault: Fault) -> set[tuple[Fault, int]]:
        """The fault on each of its axes, however they are called."""
        return {(replace(fault, node=ALL), axis) for axis in fault.axes(self._virtual)}

    def _axis(self, number: int) -> str:
        return list(self._virtual.machine.axes)[number]

    def _end(self, fault: Fault) -> None:
        fault.end(self._virtual)
        self._there -= self._struck(fault)

    def _strike(self, fault: Fault, told_duration: object) -> Fault:
        duration = _duration(fault, told_duration)
        fault.strike(self._virtual)
        if isinstance(fault, LastingFault):
            self._there |= self._struck(fault)
        ending = self._endings.get(fault)
        if ending is not None:
            ending.stop()
        if duration is not None:
            ending = ending or self._virtual.alarms.add(lambda _now: self._end(fault))
            ending.set(self._virtual.now() + duration)
            self._endings[fault] = ending
        return fault


def _request(line: bytes) -> dict[str, Any]:
    try:
        request = json.loads(line)
    except (ValueError, RecursionError):
        raise UserError(f"not JSON: {line[:80]!r}") from None
    return request if isinstance(request, dict) else {}


def _duration(fault: Fault, told: object) -> float | None:
    if told is None:
        return None
    if not isinstance(fault, LastingFault):
        raise UserError(f"{fault.name} strikes once and has no end; leave out how long it lasts")
    try:
        return DURATION.read(told)
    except ValueError:
        raise UserError(f"for is {told!r}, expected {DURATION.expected}") from None


def _line(answer: dict[str, object]) -> bytes:
    return json.dumps(answer).encode() + b"\n"


class ControlSocket:
    """A Control on a Unix socket for its owner alone; `work` answers what has come, in the thread of the caller.

    Raises UserError where there is something else at the path, or another emulator.
    """

    def __init__(self, path: Path, control: Control) -> None:
        self._path = path
        self._control = control
        self._lines: dict[socket.socket, bytes] = {}
        self._warned: set[str] = set()
        self._selector = selectors.DefaultSelector()
        self._listener = _listen(path)
        self._selector.register(self._listener, selectors.EVENT_READ, self._accept)

    def work(self) -> None:
        """Answer what has come; returns at once."""
        for key, _ in self._selector.select(0):
            key.data()

    def close(self) -> None:
        """End all conversations and remove the socket."""
        for connection in list(self._lines):
            self._leave(connection)
        self._selector.close()
        self._path.unlink(missing_ok=True)
        self._listener.close()

    def _accept(self) -> None:
        try:
            connection, _ = self._listener.accept()
        except OSError as error:  # no file descriptor is left: the client waits until one is
            self._warn_once(f"control: a connection cannot be accepted ({error.strerror})")
            return
        if len(self._lines) >= MOST_CONVERSATIONS:
            self._warn_once(f"control: more than {MOST_CONVERSATIONS} conversations, the newest is closed")
            connection.close()
            return
        connection.setblocking(False)
        self._lines[connection] = b""
        self._selector.register(connection, selectors.EVENT_READ, partial(self._converse, connection))

    def _warn_once(self, message: str) -> None:
        if message not in self._warned:
            self._warned.add(message)
            logger.warning("%s", message)

    def _converse(self, connection: socket.socket) -> None:
        """A client that goes, or writes without end, is left."""
        try:
            came = connection.recv(LONGEST_LINE)
            *lines, rest = (self._lines[connection] + came).split(b"\n")
            for line in lines:
                connection.sendall(self._control.answer(line))
        except OSError:
            came, rest = b"", b""
        self._lines[connection] = rest
        if not came or len(rest) > LONGEST_LINE:
            self._leave(connection)

    def _leave(self, connection: socket.socket) -> None:
        del self._lines[connection]
        self._selector.unregister(connection)
        connection.close()


def _listen(path: Path) -> socket.socket:
    _remove_if_dead(path)
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    mask = os.umask(OWNER_ONLY)
    try:
        listener.bind(str(path))
    except OSError as error:
        listener.close()
        raise UserError(f"--control {path}: {error.strerror or error}; give a path of at most 107 bytes that is free") from None
    finally:
        os.umask(mask)
    listener.listen()
    listener.setblocking(False)
    return listener


def _remove_if_dead(path: Path) -> None:
    """Remove the socket that an emulator which was killed has left; what is anything else stays."""
    if not path.is_socket():
        return
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        try:
            probe.connect(str(path))
        except ConnectionRefusedError:
            path.unlink()


@contextmanager
def serve_control(virtual: VirtualMachine, path: Path | None) -> Iterator[tuple[str, ...]]:
    """Serve faults of a machine on a socket at `path`, if there is one; yields in words what is open.

    While it is, the machine's own loop answers (`VirtualMachine.poll`). Raises UserError where the path is not to be had.
    """
    if path is None:
        yield ()
        return
    door = ControlSocket(path, Control(virtual))
    virtual.attach(door.work)
    try:
        yield (f"control on {path}",)
    finally:
        door.close()
