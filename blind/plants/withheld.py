"""The withheld plant: what a machine's drives move, its physics written in another way than the library's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetwin.blind.foreign import Axis, Foreign
from drivetwin.blind.machines import DrawnMachine
from drivetwin.blind.plants.friction import ELEMENTS
from drivetwin.blind.plants.rigid import RigidBodies
from drivetwin.blind.plants.step import STATE, advance, read_encoders
from drivetwin.emulator.drive.servo import SERVO_PERIOD, ServoBank, filter_share
from drivetwin.emulator.plant import Plant

STEPS = 4
"""Steps a servo period: of 31.25 us."""


class WithheldPlant(Plant):
    """A machine's plant that has nothing but its drives' interface in common with the emulator's own."""

    def __init__(
        self,
        machine: DrawnMachine,
        axes: NDArray[np.void],
        bodies: RigidBodies,
        formulation: int,
        foreign: tuple[tuple[int, Foreign], ...] = (),
    ) -> None:
        """`axes` (n,) as `withheld_axes` makes them; `bodies` with the rotors of the axes whose transmission is rigid.

        `foreign`: what else acts, each with the index of its axis.
        """
        count = len(axes)
        self._axes = axes
        self._bodies = (bodies.inertia, bodies.swing, bodies.weight, bodies.outer)
        self._formulation = formulation
        self._state = np.zeros(count, dtype=STATE)
        start = np.array([axis.power_on_position for axis in machine.axes.values()])
        self._state["motor_position"] = start
        waves = axes["error_order"] * axes["gear"] * start + axes["error_phase"]
        self._state["position"] = start + axes["error_amplitude"] * np.sin(waves)
        self._bristles = np.zeros((count, ELEMENTS))
        self._time = 0.0
        self._foreign = foreign
        self._low = [axis.travel[0] for axis in machine.axes.values()]
        self._entered = np.zeros(count, dtype=np.bool_)
        self._gains, self._frictions, self._pulls = np.ones(count), np.ones(count), np.zeros(count)
        self.motor_position, self.motor_torque = np.zeros(count), np.zeros(count)
        self._angle = np.zeros(count)
        self._encoder = LateEncoders(axes["delay"], formulation)
        self._read()

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._time

    def joint_positions(self) -> NDArray[np.float64]:
        """True joint positions (n,) [rad or m]."""
        return np.array(self._state["position"])

    def joint_velocities(self) -> NDArray[np.float64]:
        """True joint velocities (n,) [rad/s or m/s]."""
        return np.array(self._state["velocity"])

    def equip(self, servos: ServoBank) -> None:
        """Let the drives' loops have the power stages that they truly have."""
        for parameters, axis in zip(servos.parameters, self._axes, strict=True):
            parameters["current_limit"] = axis["current_limit"] / axis["gear"]
            if axis["bandwidth"] > 0.0:
                parameters["current_filter"] = filter_share(1.0 / (2.0 * np.pi * axis["bandwidth"]))

    def rehearse(self, servos: ServoBank) -> None:
        """Nothing: no frame of another program waits for what its first cycle compiles."""

    def advance(self, servos: ServoBank) -> None:
        """Run `servos.periods` servo periods: encoder, loops, and the machine in small steps."""
        self._disturb(servos.periods * SERVO_PERIOD)
        for period in range(servos.periods):
            self._read()
            servos.run(period, self.motor_position, self.motor_torque)
            advance(
                *(self._axes, self._state, self._bristles, self._bodies, self.motor_torque, servos.brakes),
                *(self._gains, self._frictions, self._pulls, self._formulation),
                *(self._time, STEPS, SERVO_PERIOD / STEPS),
            )
            self._time += SERVO_PERIOD

    def truth(self) -> dict[str, dict[str, float]]:
        """Nothing: the key has it."""
        return {}

    def _disturb(self, cycle: float) -> None:
        """Ask what the foreign effects do in a cycle [s]; they begin when their axis has been homed and enters its travel."""
        for index, effect in self._foreign:
            joint = self._state[index]
            self._entered[index] |= joint["position"] > self._low[index]
            if not self._entered[index]:
                continue
            influence = effect.act(Axis(float(joint["position"]), float(joint["velocity"]), self._time, cycle))
            self._gains[index], self._frictions[index] = influence.gain, influence.friction
            self._pulls[index] = influence.pull

    def _read(self) -> None:
        read_encoders(self._axes, self._state, self._angle)
        self.motor_position[:] = self._encoder.read(self._angle)


class LateEncoders:
    """Readings that come late: by a serial line, or by a mean over twice the delay in the encoder itself.

    The line with LuGre's friction, the mean with the Maxwell-slip model's.
    """

    def __init__(self, delays: NDArray[np.float64], formulation: int) -> None:
        """`delays` (n,) [s]."""
        periods = delays / SERVO_PERIOD
        self._weights = [_mean_of(late) if formulation else _line_of(late) for late in periods]
        self._length = max(len(weights) for weights in self._weights)
        self._history = np.zeros((0, len(delays)))

    def read(self, angle: NDArray[np.float64]) -> NDArray[np.float64]:
        """What arrives now (n,), of the angles now (n,)."""
        if self._length == 1:
            return angle
        if not len(self._history):
            self._history = np.tile(angle, (self._length, 1))
        self._history[1:] = self._history[:-1].copy()
        self._history[0] = angle
        return np.array([weights @ self._history[: len(weights), axis] for axis, weights in enumerate(self._weights)])


def _line_of(late: float) -> NDArray[np.float64]:
    """Weights of the last readings, newest first: `late` periods ago, by a straight line between two."""
    whole, share = int(late), late - int(late)
    weights = np.zeros(whole + 2 if share else whole + 1)
    weights[whole] = 1.0 - share
    if share:
        weights[whole + 1] = share
    return weights


def _mean_of(late: float) -> NDArray[np.float64]:
    """Weights of a mean whose middle is `late` periods ago."""
    count = round(2.0 * late) + 1
    return np.full(count, 1.0 / count)
