"""The glance at a drive that every cycle takes: whatever a check would report, it has to see."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.controller.drive_node import OPERATION_ENABLED, DriveNode, Emergency
from drivetwin.controller.supervision import CHECKS, VOLTAGE_ENABLED, Watch, is_plainly_sound

SOUND = OPERATION_ENABLED | VOLTAGE_ENABLED


def drive(**values: object) -> DriveNode:
    """An enabled drive that streams and stands, without trouble, but for `values`."""
    liveness: dict[str, object] = {"expected": True, "boots": 0, "silence": 0.0, "state": 0x05}
    liveness |= {name: values.pop(name) for name in list(values) if name in liveness}
    made = SimpleNamespace(
        **{"name": "lift", "node_id": 1, "unit": 1e-6, "received": 1, "answers": True, "homed": True, "operating": True},
        **{"streaming": True, "position": 0, "following_error": 0, "following_error_limit": 100, "allowed": (-1000, 1000)},
        **{"statusword": SOUND, "emergencies": [], "torque": 0.0, "torque_limit": 1.0},
    )
    vars(made).update(values, liveness=SimpleNamespace(**liveness), axis=SimpleNamespace(max_speed=1.0))
    made.state, made.outside = made.statusword & 0x6F, made.allowed is not None and not -1000 <= made.position <= 1000
    made.where, made.joint_torque = (lambda: "axis lift"), (lambda torque: torque)
    return cast(DriveNode, made)


DRIVES = st.fixed_dictionaries(
    {},
    optional={
        "expected": st.booleans(),
        "boots": st.integers(0, 1),
        "silence": st.sampled_from((0.0, 10.0)),
        "state": st.sampled_from((None, 0x04, 0x05, 0x7F)),
        "received": st.integers(0, 2),
        "answers": st.booleans(),
        "operating": st.booleans(),
        "streaming": st.booleans(),
        "position": st.sampled_from((0, 5, -1001, 1001, 10**6)),
        "following_error": st.sampled_from((0, 100, 101)),
        "following_error_limit": st.sampled_from((None, 100)),
        "allowed": st.sampled_from((None, (-1000, 1000))),
        "statusword": st.sampled_from((SOUND, OPERATION_ENABLED, 0x31, 0x18, 0x1F, SOUND | 1 << 12)),
        "emergencies": st.sampled_from(([], [Emergency(0x8611, b"")])),
    },
)
WATCHES = st.fixed_dictionaries(
    {},
    optional={
        "missed": st.integers(0, 4),
        "surplus": st.integers(0, 1),
        "at_limit": st.sampled_from((0.0, 0.29, 0.3)),
        "position": st.sampled_from((None, 0)),
        "speed": st.sampled_from((0.0, 1e6)),
        "age": st.sampled_from((0.001, 0.1)),
    },
)


@settings(deadline=None, max_examples=500)
@given(DRIVES, WATCHES)
def test_what_looks_sound_passes_every_check(of_drive: dict[str, object], of_watch: dict[str, object]) -> None:
    watch = Watch(drive(**of_drive), 0.001, **of_watch)  # type: ignore[arg-type]
    if is_plainly_sound(watch):
        assert [check(watch) for check in CHECKS] == [None] * len(CHECKS)


def test_a_drive_that_streams_without_trouble_looks_sound() -> None:
    assert is_plainly_sound(Watch(drive(), 0.001, position=0, age=0.001))
