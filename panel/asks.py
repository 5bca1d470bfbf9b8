"""What a page may ask for: one class each, whose fields are what it says and whose `answer` is what it gets."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from drivetwin.foundation.errors import UserError
from drivetwin.panel.dictionary import told_objects
from drivetwin.panel.panel import Panel
from drivetwin.panel.parameter_desk import restore
from drivetwin.panel.parameter_file import ParameterFile, read_parameters
from drivetwin.panel.power_states import COMMANDS
from drivetwin.panel.scope.picture import Span
from drivetwin.panel.scope.save import recording_of
from drivetwin.panel.scope.trigger import Trigger
from drivetwin.panel.values import Value, decode, encode
from drivetwin.panel.words import NMT_COMMANDS

STORE = b"save"
"""What 1010h:01 asks for (CiA 301, 7.5.2.13)."""


class _Ask(BaseModel, ABC):
    """`writes`: it changes something on the bus or the machine, so that the page needs the pen.

    `of_a_drive`: it only reads from a drive, which may be slow to answer; what is asked after it does not wait.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    writes: ClassVar[bool] = False
    of_a_drive: ClassVar[bool] = False

    @abstractmethod
    def answer(self, panel: Panel) -> object:
        """Raises UserError for what cannot be done."""


class Objects(_Ask):
    """The object dictionary of a node's drive type."""

    ask: Literal["objects"]
    node: int

    def answer(self, panel: Panel) -> object:
        return told_objects(panel.node(self.node).profile, self.node)


class Read(_Ask):
    """One object by SDO."""

    of_a_drive: ClassVar[bool] = True

    ask: Literal["read"]
    node: int
    index: int
    subindex: int

    def answer(self, panel: Panel) -> Value | None:
        node = panel.node(self.node)
        entry = node.entry(self.index, self.subindex)
        return decode(entry.data_type, node.read(self.index, self.subindex))


class Write(_Ask):
    """One object by SDO; the answer is what the drive then holds."""

    writes: ClassVar[bool] = True

    ask: Literal["write"]
    node: int
    index: int
    subindex: int
    value: str

    def answer(self, panel: Panel) -> Value | None:
        node = panel.node(self.node)
        entry = node.entry(self.index, self.subindex)
        if not entry.access.writable:
            raise UserError(f"{entry.name} ({self.index:04X}h:{self.subindex:02X}) is {entry.access}: it cannot be written")
        node.write(self.index, self.subindex, encode(entry, self.value))
        return decode(entry.data_type, node.read(self.index, self.subindex)) if entry.access.readable else None


class _OfFile(_Ask):
    """A file of parameters that the page holds: an EDS, a DCF or a snapshot."""

    node: int
    name: str
    text: str

    def read(self, panel: Panel) -> ParameterFile:
        """Raises UserError for what is no such file."""
        return read_parameters(Path(self.name).name or "the file", self.text, panel.node(self.node).entries, self.node)


class Compare(_OfFile):
    """What a file says of the drive's objects; nothing is written."""

    ask: Literal["compare"]

    def answer(self, panel: Panel) -> dict[str, object]:
        file, entries = self.read(panel), panel.node(self.node).entries
        values = [[*address, decode(entries[address].data_type, data)] for address, data in sorted(file.values.items())]
        return {"values": values, "strange": file.strange}


class Restore(_OfFile):
    """Write what a file says, where it differs."""

    writes: ClassVar[bool] = True

    ask: Literal["restore"]

    def answer(self, panel: Panel) -> dict[str, object]:
        return asdict(restore(panel.node(self.node), self.read(panel)))


class Store(_Ask):
    """All parameters of a node into its memory (1010h:01)."""

    writes: ClassVar[bool] = True

    ask: Literal["store"]
    node: int

    def answer(self, panel: Panel) -> None:
        node = panel.node(self.node)
        node.entry(0x1010, 1)
        node.write(0x1010, 1, STORE)


class Command(_Ask):
    """A command of the controlword, by SDO."""

    writes: ClassVar[bool] = True

    ask: Literal["command"]
    node: int
    name: str

    def answer(self, panel: Panel) -> None:
        known = {command.name: command for command in COMMANDS}
        if self.name not in known:
            raise UserError(f"unknown command {self.name!r}; known are {', '.join(known)}")
        node = panel.node(self.node)
        if known[self.name].controlword & 0x80:  # a reset acts on the bit's rising edge
            node.write(0x6040, 0, bytes(2))
        node.write(0x6040, 0, known[self.name].controlword.to_bytes(2, "little"))


class Nmt(_Ask):
    """An NMT command to one node."""

    writes: ClassVar[bool] = True

    ask: Literal["nmt"]
    node: int
    name: str

    def answer(self, panel: Panel) -> None:
        if self.name not in NMT_COMMANDS:
            raise UserError(f"unknown NMT command {self.name!r}; known are {', '.join(NMT_COMMANDS)}")
        panel.link.send_message(0, bytes((NMT_COMMANDS[self.name], panel.node(self.node).node_id)))


class Move(_Ask):
    """Start or end the motion of the machine that the panel emulates."""

    writes: ClassVar[bool] = True

    ask: Literal["motion"]
    runs: bool

    def answer(self, panel: Panel) -> None:
        if panel.motion is None:
            raise UserError("this panel moves nothing: it has joined the bus of a machine that it did not start")
        if self.runs and panel.commissioning is not None and panel.commissioning.runs:
            raise UserError("an axis is being measured; stop that first, in the view commissioning")
        if self.runs:
            panel.motion.start()
        else:
            panel.motion.stop()


class Commission(_Ask):
    """Measure an axis of the machine that the panel emulates; None ends it."""

    writes: ClassVar[bool] = True

    ask: Literal["commission"]
    axis: str | None

    def answer(self, panel: Panel) -> None:
        if panel.commissioning is None:
            raise UserError("this panel moves nothing; commission the machine with drivetwin bode --bus BUS")
        if self.axis is None:
            panel.commissioning.stop()
        else:
            panel.commissioning.start(self.axis)


class TriggerOn(BaseModel):
    """As panel/scope/trigger.py has it."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    channel: str
    kind: Literal["rises", "falls", "state"]
    level: float = 0.0
    state: str = ""


class ScopeSet(_Ask):
    """What the scope shows, and what it waits for."""

    ask: Literal["scope set"]
    channels: list[str]
    window: float
    pre: float
    trigger: TriggerOn | None
    xy: tuple[str, str] | None

    def answer(self, panel: Panel) -> None:
        trigger = None if self.trigger is None else Trigger(**self.trigger.model_dump())
        panel.scope.set(list(dict.fromkeys(self.channels)), self.window, self.pre, trigger, self.xy)


class ScopeRun(_Ask):
    """Run the scope, or stop it and hold what it shows."""

    ask: Literal["scope run"]
    runs: bool

    def answer(self, panel: Panel) -> None:
        panel.scope.run(self.runs)


class ScopeZoom(_Ask):
    """A span of what the scope holds, as finely as a screen can show it."""

    ask: Literal["scope zoom"]
    start: float
    end: float

    def answer(self, panel: Panel) -> dict[str, object]:
        held = panel.scope.held
        if held is None or not self.start < self.end:
            raise UserError("only what is held can be zoomed; press stop, or let the trigger fire")
        return panel.scope.picture(held, Span(self.start, self.end))


class ScopeRecording(_Ask):
    """Whether what the scope shows makes a recording; a page asks before it fetches the file."""

    ask: Literal["scope recording"]

    def answer(self, panel: Panel) -> None:
        recording_of(panel.scope.settings.channels, panel.scope.shown(), panel.machine)


class Faults(_Ask):
    """Every fault with its parameters."""

    ask: Literal["faults"]

    def answer(self, panel: Panel) -> dict[str, Any]:
        return panel.faults.kinds()


class Strike(_Ask):
    """A fault, until it is ended or for some seconds of the machine's time."""

    writes: ClassVar[bool] = True

    ask: Literal["strike"]
    told: dict[str, str | int | float]
    seconds: float | None

    def answer(self, panel: Panel) -> None:
        panel.faults.strike(dict(self.told), self.seconds)


class End(_Ask):
    """Take a fault's cause away."""

    writes: ClassVar[bool] = True

    ask: Literal["end"]
    told: dict[str, str | int | float]

    def answer(self, panel: Panel) -> None:
        panel.faults.end(dict(self.told))


class Mesh(_Ask):
    """The vertices and triangles of a mesh of the machine's model."""

    ask: Literal["mesh"]
    mesh: int

    def answer(self, panel: Panel) -> dict[str, str]:
        if panel.model is None:
            raise UserError("this panel does not know the machine on its bus")
        return panel.model.mesh(self.mesh)


class BitRate(_Ask):
    """Measure the load against a bus of this bit rate [bit/s]; nothing changes on the bus itself."""

    ask: Literal["bit rate"]
    bit_rate: int

    def answer(self, panel: Panel) -> None:
        panel.bus.set_bit_rate(self.bit_rate)


_OfScope = ScopeSet | ScopeRun | ScopeZoom | ScopeRecording
_OfFaults = Faults | Strike | End

_OfParameters = Objects | Read | Write | Compare | Restore | Store

Ask = _OfParameters | Command | Nmt | Move | Commission | Mesh | BitRate | _OfScope | _OfFaults

_ASK: TypeAdapter[Ask] = TypeAdapter(Annotated[Ask, Field(discriminator="ask")])


def read_ask(told: dict[str, Any]) -> Ask:
    """Raises UserError naming what is wrong."""
    try:
        return _ASK.validate_python(told)
    except ValidationError as error:
        first = error.errors()[0]
        raise UserError(f"{'.'.join(map(str, first['loc'])) or 'the question'}: {first['msg']}") from None
