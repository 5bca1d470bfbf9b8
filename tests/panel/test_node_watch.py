"""What is seen of a drive: its PDOs and its unit are read anew when the panel itself has changed them, and read whole."""

from __future__ import annotations

import pytest

from drivetwin.drive_profiles import load_profile
from drivetwin.foundation.errors import UserError
from drivetwin.panel.door import Door, ObjectRefusedError
from drivetwin.panel.node_watch import Axis, NodeWatch
from drivetwin.panel.pdo_reading import read_pdos

SERVOONE = load_profile("servoone")
TYPES = {(entry.index, entry.subindex): entry.data_type for entry in SERVOONE.objects}


class Held(Door):
    """A drive that holds 0 in every object but those that were written."""

    def __init__(self) -> None:
        super().__init__(lambda _node: 1e6)
        self.values: dict[tuple[int, int], int] = {(0x6091, 1): 1, (0x6091, 2): 1, (0x6092, 1): 1000, (0x6092, 2): 1}
        self.silent = False

    def read(self, node_id: int, index: int, subindex: int) -> bytes:
        if self.silent and index == 0x6092:
            raise UserError("no answer")
        return self.values.get((index, subindex), 0).to_bytes(4, "little")

    def write(self, node_id: int, index: int, subindex: int, data: bytes) -> None:
        self.values[index, subindex] = int.from_bytes(data, "little")

    def is_free(self, node_id: int) -> bool:
        return True

    def catch_up(self) -> None:
        """Nothing passes."""


def watched() -> tuple[NodeWatch, Held]:
    door = Held()
    return NodeWatch(door, 1, SERVOONE, Axis("lift", "lift", 50.0, "rad")), door


def test_the_unit_is_another_one_after_the_panel_has_changed_the_feed() -> None:
    node, _ = watched()
    node.refresh()
    before = node.unit
    assert before is not None
    node.refresh()
    node.write(0x6092, 1, (2000).to_bytes(4, "little"))
    node.refresh()
    assert node.unit == pytest.approx(0.5 * before)


def test_a_drive_that_tells_no_feed_has_no_unit() -> None:
    node, door = watched()
    door.values[0x6092, 1] = 0
    node.refresh()
    assert (node.unit, node.silent) == (None, "")


def test_what_went_wrong_before_is_told_once_though_the_drive_falls_silent_meanwhile() -> None:
    node, door = watched()
    door.values |= {(0x1003, 0): 1, (0x1003, 1): 0x8130}
    door.silent = True
    node.refresh()
    assert node.silent == "no answer"
    door.silent = False
    node.refresh()
    assert [one.code for one in node.emergencies] == [0x8130]


def test_a_late_answer_is_no_missing_pdo() -> None:
    def late(_index: int, _subindex: int) -> bytes:
        raise UserError("no answer")

    def refused(_index: int, _subindex: int) -> bytes:
        raise ObjectRefusedError("there is no such object")

    with pytest.raises(UserError, match="no answer"):
        read_pdos(late, TYPES)
    assert read_pdos(refused, TYPES) == {}
