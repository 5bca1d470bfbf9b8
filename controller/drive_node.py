"""One drive as the controller knows it: its objects by SDO, its scaling, its two cyclic PDOs and its statusword."""

from __future__ import annotations

import logging
import struct
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from math import inf

import canopen
import numpy as np
from canopen.objectdictionary import ObjectDictionaryError
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError
from numpy.typing import NDArray

from drivetwin.controller.dictionary import object_dictionary
from drivetwin.controller.link import NMT_COB_ID, Link, PumpedNode
from drivetwin.controller.liveness import BASE_COB_ID, Liveness
from drivetwin.controller.machine import POSITION_UNIT, Axis
from drivetwin.controller.trouble import TroubleError
from drivetwin.drive_profiles import DriveProfile, Role
from drivetwin.foundation.errors import UserError

logger = logging.getLogger(__name__)

NO_ANSWER = (SdoAbortedError, SdoCommunicationError, ObjectDictionaryError)
"""What canopen raises of an SDO transfer: aborted, without an answer, or answered by bytes that are no value of the object."""

OUTPUT = struct.Struct("<Hih")
"""RPDO 1: controlword, position set-point, torque offset."""

VELOCITY_OFFSET = struct.Struct("<i")
"""RPDO 2, where it is mapped: velocity offset."""

INPUT = struct.Struct("<if")
"""TPDO 2: position actual value, torque actual value as float32."""

SYNCHRONOUS, EVENT_DRIVEN = 1, 255

START, ENTER_PRE_OPERATIONAL, RESET_COMMUNICATION = 0x01, 0x80, 0x82
"""NMT command specifiers (CiA 301, 7.2.8.3.1.2)."""

REFRESH = 10
"""Cycles after which a drive that follows no set-points is told again what has not changed: a frame may have been lost."""

GREATEST_I16 = 0x7FFF

SAVE = int.from_bytes(b"save", "little")

STORE_TIMEOUT = 10.0
"""Longest wait for the answer to 1010h, before which the drive writes its flash [s]."""

COMMAND_TIMEOUT = 0.05
"""Longest wait for the answer to a command by SDO [s]: other axes are to be stopped, too."""

MOST_UNSIGNED32 = 0xFFFF_FFFF

STATE_MASK = 0x6F
SWITCH_ON_DISABLED, READY_TO_SWITCH_ON, SWITCHED_ON, OPERATION_ENABLED = 0x40, 0x21, 0x23, 0x27
FAULT_MASK, FAULT = 0x4F, 0x08
"""States in the statusword (CiA 402-2, table 'State coding'). Bit 5 is free where voltage is off for good or by a fault."""


NO_ERROR = 0x0000
"""EMCY that says that errors are gone (CiA 301, table 26)."""


@dataclass(frozen=True)
class Emergency:
    """An EMCY of a drive: error code and manufacturer bytes."""

    code: int
    data: bytes


class DriveNode:
    """A drive on a node-ID, of a drive type, moving a machine's axis."""

    def __init__(self, link: Link, name: str, axis: Axis, profile: DriveProfile) -> None:
        self.name = name
        self.axis = axis
        self.profile = profile
        self.node_id = axis.node_id
        self.controlword = 0
        self.setpoint = 0
        self.torque_offset = 0
        self.takes_velocity_offset = False
        self.velocity_offset = 0
        self.statusword = 0
        self.position = 0
        self.torque = 0.0
        self.received = 0
        self.answers = True
        self.operating = False
        self.streaming = False
        self.homed = False
        self.torque_limit = inf
        self.following_error_limit: int | None = None
        self.liveness = Liveness()
        self.allowed: tuple[int, int] | None = None
        self.emergencies: list[Emergency] = []
        self._link = link
        self._node = PumpedNode(axis.node_id, object_dictionary(profile))
        link.add_node(self._node)
        self._node.emcy.add_callback(self._take_emergency)
        self._rpdo_cob_id = 0x200 + axis.node_id
        self._input = b""
        self._output = b""
        self._repeated = 0
        self._setpoints: deque[int] = deque([0], maxlen=self.setpoint_delay + 1)
        link.fast[BASE_COB_ID + axis.node_id] = self.liveness.take

    # -- SDO ----------------------------------------------------------------------------------------------------------

    def read(self, index: int, subindex: int = 0) -> int | float | str:
        """Raw value of an object.

        Raises UserError where the drive is silent or aborts, naming axis, object and reason.
        """
        try:
            value = self._variable(index, subindex).raw
        except NO_ANSWER as error:
            raise self._sdo_error("reading", index, subindex, error) from None
        return value.decode() if isinstance(value, bytes) else value

    def write(self, value: float, index: int, subindex: int = 0) -> None:
        """Write a raw value and read it back.

        Raises UserError as `read`, and where another value comes back.
        """
        try:
            self._variable(index, subindex).raw = value
        except NO_ANSWER as error:
            raise self._sdo_error(f"writing {value} to", index, subindex, error) from None
        back = float(self.read(index, subindex))
        if abs(back - value) > 1e-6 * abs(value):
            raise UserError(
                f"{self.where()}: wrote {value} to {place(index, subindex)} and read back {back}; the drive refused it silently"
            )

    def store_parameters(self) -> None:
        """Have the drive keep all its application parameters without power (1010h:03; CiA 301, 7.5.2.13).

        Raises UserError where it does not.
        """
        try:
            with self._patience(STORE_TIMEOUT):
                self._variable(0x1010, 3).raw = SAVE
        except NO_ANSWER as error:
            raise self._sdo_error("storing by", 0x1010, 3, error) from None

    def reset_communication(self) -> None:
        """NMT: begin anew with a boot-up message, not configured."""
        self._link.send(NMT_COB_ID, bytes((RESET_COMMUNICATION, self.node_id)))

    def start_operation(self) -> None:
        """NMT: operational."""
        self._link.send(NMT_COB_ID, bytes((START, self.node_id)))

    def leave_operational(self) -> None:
        """NMT: pre-operational, in which a drive hears SDO and acts on no PDO (CiA 301, 7.3.2.2.5).

        A heartbeat that says so is then no trouble, and who goes on with the drive has to configure it anew.
        """
        self.liveness.expected = False
        self._link.send(NMT_COB_ID, bytes((ENTER_PRE_OPERATIONAL, self.node_id)))

    def command(self, controlword: int) -> None:
        """Write the controlword by SDO, for a drive that takes no PDOs, and read what its statusword says.

        Raises UserError where it does not answer soon, or aborts.
        """
        self.controlword = controlword
        try:
            with self._patience(COMMAND_TIMEOUT):
                self._variable(0x6040, 0).raw = controlword
                self.statusword = int(self._variable(0x6041, 0).raw)
        except NO_ANSWER as error:
            raise self._sdo_error("commanding by", 0x6040, 0, error) from None

    def role(self, name: str) -> Role | None:
        """Where this drive type keeps a quantity, None where it does not."""
        return self.profile.roles.get(name)

    def has(self, index: int, subindex: int = 0) -> bool:
        """Whether the drive type has an object."""
        return any((entry.index, entry.subindex) == (index, subindex) for entry in self.profile.objects)

    def read_role(self, name: str) -> float | None:
        """SI value on the motor side of a quantity, None where the drive type does not have it."""
        role = self.role(name)
        return None if role is None else float(self.read(role.index, role.subindex)) * role.si_per_unit

    def write_role(self, name: str, raw: float) -> None:
        """Write the raw value of a quantity that the drive type may or may not have."""
        role = self.role(name)
        if role is not None:
            self.write(raw, role.index, role.subindex)

    def limit_following_error(self, distance: float) -> None:
        """The greatest following error [m or rad]: for this controller, and for the drive where its type has such a limit."""
        self.following_error_limit = self.in_units(distance)
        self.write_role("following_error_limit", self.following_error_limit)

    def where(self) -> str:
        """How errors name this drive."""
        return f"axis {self.name} (node {self.node_id})"

    def stay_within(self, low: float, high: float) -> None:
        """From now on a position outside low .. high [m or rad] ends the cycle with an error."""
        self.allowed = (self.in_units(low), self.in_units(high))

    @property
    def outside(self) -> bool:
        """Whether the axis has left the travel it was told to stay within."""
        return self.allowed is not None and not self.allowed[0] <= self.position <= self.allowed[1]

    @property
    def interpolation(self) -> str:
        """How the drive goes from set-point to set-point, as `bring_up` configures it."""
        return "cubic_spline" if "cubic_spline" in self.profile.interpolation_codes else "linear"

    @property
    def setpoint_weights(self) -> tuple[float, ...]:
        """Weights of the set-point of a cycle ago, of two cycles ago, ... in the position demand (6062h) at a SYNC.

        A straight line ends on its set-point a cycle later; a uniform cubic B-spline passes a cycle after that by its
        point (de Boor, A Practical Guide to Splines, 1978, ch. IX).
        """
        return (1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0) if self.interpolation == "cubic_spline" else (1.0,)

    @property
    def setpoint_delay(self) -> int:
        """Cycles from the SYNC at which a set-point takes effect to the SYNC at which it is the position demand (6062h)."""
        return 1 + len(self.setpoint_weights) // 2

    # -- PDO ----------------------------------------------------------------------------------------------------------

    def map_pdos(self) -> None:
        """RPDO 1 and TPDO 2 at each SYNC, 8 bytes each; TPDO 1 with the statusword on change; nothing else.

        With SYNC that is what three axes can carry on 1 Mbit/s in 1 ms. A drive that takes a velocity offset has it in RPDO 2
        at each SYNC as well, which takes a longer cycle.
        Raises UserError where a mapping is refused or read back different.
        """
        setpoint, torque = self.profile.roles["position_setpoint"], self.profile.roles["torque_actual"]
        outputs = [(0x6040, 0), (setpoint.index, setpoint.subindex), (0x60B2, 0)]
        inputs = [(0x6064, 0), (torque.index, torque.subindex)]
        self._map(self._node.rpdo[1], outputs, SYNCHRONOUS)
        self._map(self._node.tpdo[1], [(0x6041, 0)], EVENT_DRIVEN)
        self._map(self._node.tpdo[2], inputs, SYNCHRONOUS)
        if self.takes_velocity_offset:
            self._map(self._node.rpdo[2], [(0x60B1, 0)], SYNCHRONOUS)
        else:
            self._disable(self._node.rpdo[2])
        for unused in (self._node.rpdo[3], self._node.rpdo[4], self._node.tpdo[3], self._node.tpdo[4]):
            self._disable(unused)
        self._link.fast[0x180 + self.node_id] = self._take_status
        self._link.fast[0x280 + self.node_id] = self._take_input

    def send_output(self) -> None:
        """Send RPDO 1, and 2 where it is mapped; they take effect at the next SYNC.

        A drive that follows set-points gets one each cycle. One that stands or moves by itself is told what changes, and that
        again every `REFRESH` cycles: that leaves the bus room for SDO.
        """
        self._setpoints.append(self.setpoint)
        output = OUTPUT.pack(self.controlword, self.setpoint, self.torque_offset)
        self._repeated += 1
        if output == self._output and not self.streaming and self._repeated < REFRESH:
            return
        self._output, self._repeated = output, 0
        self._link.send(self._rpdo_cob_id, output)
        if self.takes_velocity_offset:
            self._link.send(0x300 + self.node_id, VELOCITY_OFFSET.pack(self.velocity_offset))

    def follow(self) -> None:
        """From now on the axis follows its set-point, which is where it is held."""
        self._setpoints.extend([self.setpoint] * (self.setpoint_delay + 1))
        self.streaming = True

    @property
    def following_error(self) -> int:
        """How far the axis is from the set-point that it was to reach by the last SYNC, in position units."""
        return abs(self._setpoints[0] - self.position)

    def clear_offsets(self) -> None:
        """Nothing beside the set-point from the next cycle on."""
        self.torque_offset = 0
        self.velocity_offset = 0

    @property
    def state(self) -> int:
        """State bits of the statusword; SWITCH_ON_DISABLED and FAULT whatever bit 5 says."""
        free = self.statusword & FAULT_MASK
        return free if free in (SWITCH_ON_DISABLED, FAULT) else self.statusword & STATE_MASK

    def _take_emergency(self, error: canopen.emcy.EmcyError) -> None:
        if error.code != NO_ERROR:
            self.emergencies.append(Emergency(error.code, bytes(error.data)))

    def _take_status(self, data: bytes) -> None:
        self.statusword = data[0] | data[1] << 8

    def _take_input(self, data: bytes) -> None:
        """A sample. The same once more is no second one: CAN itself doubles a frame whose last bit was disturbed for its sender
        alone (ISO 11898-1, end of frame), and two samples of one SYNC differ by the noise of the torque at least.
        """
        if self.received and data == self._input:
            return
        self._input = data
        self.position, self.torque = INPUT.unpack(data)
        self.received += 1

    def _map(self, pdo: canopen.pdo.base.PdoMap, objects: list[tuple[int, int]], transmission_type: int) -> None:
        try:
            pdo.read()
            pdo.clear()
            for index, subindex in objects:
                pdo.add_variable(index, subindex)
            pdo.trans_type = transmission_type
            pdo.cob_id = pdo.predefined_cob_id
            pdo.enabled = True
            pdo.save()
            pdo.read()
        except NO_ANSWER as error:
            raise UserError(f"{self.where()}: mapping {pdo.name} failed: {error}") from None
        mapped = [(variable.index, variable.subindex) for variable in pdo.map]
        if mapped != objects or pdo.trans_type != transmission_type or not pdo.enabled:
            wanted = ", ".join(place(*entry) for entry in objects)
            came = ", ".join(place(*entry) for entry in mapped)
            raise UserError(f"{self.where()}: {pdo.name} was mapped to {wanted} and reads back {came or 'empty'}")

    def _disable(self, pdo: canopen.pdo.base.PdoMap) -> None:
        try:
            pdo.read()
            if pdo.enabled:
                pdo.enabled = False
                pdo.save()
        except NO_ANSWER as error:
            raise UserError(f"{self.where()}: disabling {pdo.name} failed: {error}") from None

    # -- scaling ------------------------------------------------------------------------------------------------------

    def write_scaling(self) -> None:
        """Factor group: positions in `POSITION_UNIT`, velocities and accelerations in that a second (squared)."""
        axis = self.axis
        self.write(0, 0x607E)  # positive torque and positive motion are one direction
        self.write(axis.gear[0], 0x6091, 1)
        self.write(axis.gear[1], 0x6091, 2)
        self.write(round(axis.feed_constant / POSITION_UNIT), 0x6092, 1)
        self.write(1, 0x6092, 2)

    @cached_property
    def unit(self) -> float:
        """Joint travel of one position unit [m or rad], as the integers of the factor group make it."""
        return self.axis.feed_constant / round(self.axis.feed_constant / POSITION_UNIT)

    def in_units(self, value: float) -> int:
        """A position [m or rad], speed or acceleration in the drive's user units."""
        return round(value / self.unit)

    def ramp(self, acceleration: float) -> int:
        """An acceleration [m/s² or rad/s²] as an object holds it: UNSIGNED32, so a larger one is the largest."""
        return min(self.in_units(acceleration), MOST_UNSIGNED32)

    def torque_offsets(self, joint: NDArray[np.float64]) -> list[int]:
        """60B2h for joint torques (n,) [N·m or N], one a cycle: per mille of the motor's rated torque (6076h).

        What rounding leaves is carried to the next cycle, so that it is no error but at frequencies that no axis follows.
        Raises UserError where one is beyond the object's 16 bits.
        """
        rated = self.joint_torque(self.rated_torque)
        raw = np.diff(np.rint(np.cumsum(joint / rated * 1000.0)), prepend=0.0)
        if np.abs(raw).max(initial=0.0) > GREATEST_I16:
            most = GREATEST_I16 / 1000.0 * rated
            raise UserError(f"{self.where()}: a torque offset of {np.abs(joint).max():.4g} is beyond the {most:.4g} of 60B2h")
        return [int(value) for value in raw]

    @cached_property
    def rated_torque(self) -> float:
        """Rated torque of the motor [N·m] (6076h), to which torques in per mille refer; read once."""
        return float(self.read(0x6076)) / 1000.0

    def joint_torque(self, motor: float) -> float:
        """Joint torque or force of a motor torque [N·m]: times the gear ratio, no efficiency taken off."""
        return motor * self.axis.gear_ratio

    def motor_torque(self, joint: float) -> float:
        """Motor torque [N·m] of a joint torque or force, as `joint_torque`."""
        return joint / self.axis.gear_ratio

    # -- inside -------------------------------------------------------------------------------------------------------

    @contextmanager
    def _patience(self, seconds: float) -> Iterator[None]:
        """Wait so long for an SDO answer meanwhile."""
        sdo = self._node.sdo
        usual, sdo.RESPONSE_TIMEOUT = sdo.RESPONSE_TIMEOUT, seconds
        try:
            yield
        finally:
            sdo.RESPONSE_TIMEOUT = usual

    def _variable(self, index: int, subindex: int) -> canopen.variable.Variable:
        entry = self._node.sdo[index]
        return entry if isinstance(entry, canopen.variable.Variable) else entry[subindex]

    def _sdo_error(self, doing: str, index: int, subindex: int, error: Exception) -> UserError:
        if isinstance(error, SdoCommunicationError):
            return TroubleError(
                f"{self.where()} does not answer on {self._link.wire.channel_info} ({doing} {place(index, subindex)}): "
                f"is the drive powered, and is {self.node_id} its node-ID?",
                self.node_id,
            )
        if isinstance(error, ObjectDictionaryError):
            return TroubleError(f"{self.where()}: {doing} {place(index, subindex)}: the answer does not fit it", self.node_id)
        return UserError(f"{self.where()}: {doing} {place(index, subindex)} was aborted by the drive: {error}")


def place(index: int, subindex: int) -> str:
    """How an object is named in messages: 6040h, 60C1h:01."""
    return f"{index:04X}h" if subindex == 0 else f"{index:04X}h:{subindex:02X}"
