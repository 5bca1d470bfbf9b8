"""What the panel sends to a page by itself, as JSON's types: one function a view."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from drivetwin.panel.node_watch import ERROR_REGISTER, MODE, POSITION, STATUSWORD, Emergency, NodeWatch
from drivetwin.panel.panel import Panel
from drivetwin.panel.power_states import allowed, bit_names, mode_name, power_state
from drivetwin.panel.shown import Told
from drivetwin.panel.words import NMT_STATES, emergency_words, register_words


def drives(panel: Panel) -> Told:
    """Every node: NMT, state, allowed commands, mode, statusword, position, EMCYs; and the machine, where it is known."""
    return {"nodes": [_node(node) for node in panel.nodes.values()], "geoms": _geoms(panel)}


def parameters(panel: Panel) -> Told:
    """Which nodes there are; their objects are asked for."""
    return {"nodes": [{"id": node.node_id, "name": node.name} for node in panel.nodes.values()]}


def scope(panel: Panel) -> Told:
    """The scope's screen, decimated."""
    return panel.scope.told()


def faults(panel: Panel) -> Told:
    """What was struck, and what happened since, the last first."""
    return {
        **parameters(panel),
        "emulated": panel.control is not None,
        "struck": [vars(one) for one in panel.faults.struck],
        "events": [vars(one) for one in panel.happenings.last_first()],
    }


def bus(panel: Panel) -> Told:
    """Load, late cycles, identifiers, the last frames."""
    return panel.bus.told()


def machine(panel: Panel) -> Told:
    """The machine as its model draws it, where the drives say that it is."""
    axes = [_axis(node) for node in panel.nodes.values()]
    if panel.model is None:
        why = "No drive on a bus knows its machine. Start drivetwin panel --bus BUS --machine NAME to draw it."
        return {"geoms": None, "why": why, "axes": axes}
    return {"geoms": _geoms(panel), "left_out": panel.model.left_out, "machine": panel.machine, "axes": axes}


def _geoms(panel: Panel) -> list[Told] | None:
    """The machine as its model draws it, standing where the drives say that it is."""
    if panel.model is None:
        return None
    joints = {node.axis.joint: node.joint for node in panel.nodes.values() if node.axis is not None and node.joint is not None}
    panel.model.stand(joints)
    return panel.model.told()


def commissioning(panel: Panel) -> Told:
    """What was measured of each axis, and what is being measured."""
    desk = panel.commissioning
    return {"desk": None if desk is None else desk.told()}


def _axis(node: NodeWatch) -> Told:
    unit = node.axis.unit if node.axis is not None else ""
    return {
        "name": node.name,
        "position": node.joint,
        "unit": unit,
        **_torque(node),
        "switches": node.switches,
    }


def _torque(node: NodeWatch) -> Told:
    return {"torque": node.joint_torque, "torque_unit": "N" if node.axis is not None and node.axis.unit == "m" else "N·m"}


VIEWS: Mapping[str, Callable[[Panel], Told]] = {
    "drives": drives,
    "parameters": parameters,
    "scope": scope,
    "faults": faults,
    "bus": bus,
    "machine": machine,
    "commissioning": commissioning,
}


def _node(node: NodeWatch) -> Told:
    word, mode, position = node.number(STATUSWORD), node.number(MODE), node.number(POSITION)
    state = None if word is None else power_state(int(word))
    mode = None if mode is None else int(mode)
    register = node.number(ERROR_REGISTER)
    return {
        "id": node.node_id,
        "name": node.name,
        "silent": node.silent,
        "nmt": "no heartbeat yet" if node.nmt is None else NMT_STATES.get(node.nmt, f"unknown ({node.nmt:02X}h)"),
        "state": state,
        "commands": allowed(state),
        "statusword": word,
        "bits": bit_names(mode),
        "mode": mode,
        "mode_name": mode_name(mode),
        "position": position,
        "joint": node.joint,
        **_torque(node),
        "unit": node.axis.unit if node.axis is not None else "",
        "register": None if register is None else register_words(int(register)),
        "emergencies": [_emergency(emergency) for emergency in node.emergencies.copy()],
    }


def _emergency(emergency: Emergency) -> Told:
    return {
        "since": emergency.since,
        "code": f"{emergency.code:04X}h",
        "words": emergency_words(emergency.code),
        "register": None if emergency.register is None else register_words(emergency.register),
        "manufacturer": emergency.manufacturer.hex(" "),
    }
