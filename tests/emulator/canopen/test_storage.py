"""Store and restore parameters: 1010h and 1011h, over a power cycle and a kill (CiA 301, 7.5.2.13 and 7.5.2.14)."""

from __future__ import annotations

import json
import os
import random
import signal
import time
from pathlib import Path

import pytest
from canopen_bench import NODE, RESET_COMMUNICATION, RESET_NODE, Bench, Master, foreign_dictionary

from drivetwin.emulator.canopen import AbortCode, ParameterStore, SdoAbort
from drivetwin.emulator.canopen.parameter_store import Group
from drivetwin.foundation.errors import UserError

SAVE, LOAD = 0x65766173, 0x64616F6C
PROFILES = pytest.mark.parametrize("profile", ["cia402-full", "servoone"])
RAMP = 0x6085
"""A parameter that both drive types have (quick stop deceleration)."""


def powered(path: Path, profile: str = "cia402-full") -> Bench:
    """A drive that is switched on with what its store holds."""
    return Bench(profile, ParameterStore(path)).boot()


def configured(path: Path, profile: str = "cia402-full") -> Bench:
    bench = powered(path, profile)
    bench.write(0x1017, 0, 250)
    bench.write(RAMP, 0, 4711)
    return bench


def values(bench: Bench) -> tuple[object, object]:
    return bench.od[0x1017].value, bench.od[RAMP].value


def defaults(profile: str) -> tuple[object, object]:
    return values(Bench(profile).boot())


@PROFILES
@pytest.mark.parametrize(("subindex", "communication", "application"), [(1, True, True), (2, True, False), (3, False, True)])
def test_groups_survive_a_power_cycle(
    tmp_path: Path, profile: str, subindex: int, communication: bool, application: bool
) -> None:
    path = tmp_path / "drive.json"
    configured(path, profile).write(0x1010, subindex, SAVE)
    heartbeat, speed = defaults(profile)
    expected = (250 if communication else heartbeat, 4711 if application else speed)
    assert values(powered(path, profile)) == expected


@PROFILES
def test_what_is_not_stored_is_lost(tmp_path: Path, profile: str) -> None:
    configured(tmp_path / "drive.json", profile)
    assert values(powered(tmp_path / "drive.json", profile)) == defaults(profile)


@PROFILES
def test_a_reset_takes_the_stored_values(tmp_path: Path, profile: str) -> None:
    bench = configured(tmp_path / "drive.json", profile)
    bench.write(0x1010, 1, SAVE)
    bench.write(0x1017, 0, 1)
    bench.write(RAMP, 0, 1)
    bench.nmt(RESET_COMMUNICATION)
    assert values(bench) == (250, 1)
    bench.nmt(RESET_NODE)
    assert values(bench) == (250, 4711)


@PROFILES
def test_restored_defaults_are_valid_after_a_reset(tmp_path: Path, profile: str) -> None:
    configured(tmp_path / "drive.json", profile).write(0x1010, 1, SAVE)
    bench = powered(tmp_path / "drive.json", profile)
    bench.write(0x1011, 1, LOAD)
    assert values(bench) == (250, 4711)
    bench.nmt(RESET_NODE)
    assert values(bench) == defaults(profile)


@pytest.mark.parametrize(("subindex", "group"), [(2, 0), (3, 1)])
def test_groups_are_restored_one_by_one_over_a_power_cycle(tmp_path: Path, subindex: int, group: int) -> None:
    configured(tmp_path / "drive.json").write(0x1010, 1, SAVE)
    powered(tmp_path / "drive.json").write(0x1011, subindex, LOAD)
    expected: list[object] = [250, 4711]
    expected[group] = defaults("cia402-full")[group]
    assert values(powered(tmp_path / "drive.json")) == tuple(expected)


def test_a_mapping_survives_and_works(tmp_path: Path) -> None:
    bench = powered(tmp_path / "drive.json")
    bench.map_pdo(0x1801, (0x6064_0020, 0x6077_0010), 1)
    bench.write(0x1010, 2, SAVE)
    again = powered(tmp_path / "drive.json")
    again.nmt(b"\x01")
    again.device.sync()
    assert again.take() == [(0x280 + NODE, bytes(6))]


def test_commissioned_values_are_the_defaults_that_come_back(tmp_path: Path) -> None:
    store = ParameterStore(tmp_path / "drive.json")
    store.replace({Group.APPLICATION: {(RAMP, 0): (9).to_bytes(4, "little")}})
    bench = powered(tmp_path / "drive.json")
    assert bench.od[RAMP].value == 9
    bench.write(0x1011, 3, LOAD)
    bench.nmt(RESET_NODE)
    assert bench.od[RAMP].value == Bench().od[RAMP].value


def test_commands_and_set_points_are_not_stored(tmp_path: Path) -> None:
    bench = powered(tmp_path / "drive.json")
    for index, value in ((0x6040, 15), (0x607A, 5), (0x60B2, 7)):
        bench.write(index, 0, value)
    bench.write(0x1010, 1, SAVE)
    assert json.loads((tmp_path / "drive.json").read_text())["application"] == {}


def test_what_follows_the_node_id_is_stored_only_where_it_was_changed(tmp_path: Path) -> None:
    bench = powered(tmp_path / "drive.json")
    bench.write(0x1014, 0, 0x8000_0000 | 0x80 + NODE)
    bench.write(0x1010, 2, SAVE)
    assert list(json.loads((tmp_path / "drive.json").read_text())["communication"]) == ["1014:00"]


@pytest.mark.parametrize("index", [0x1010, 0x1011])
@pytest.mark.parametrize("value", [0, 1, SAVE + 1, 0x73617665])
def test_another_signature_is_refused(tmp_path: Path, index: int, value: int) -> None:
    with pytest.raises(SdoAbort) as refusal:
        powered(tmp_path / "drive.json").write(index, 1, value)
    assert refusal.value.code is AbortCode.NOT_STORED
    assert not (tmp_path / "drive.json").exists()


@pytest.mark.parametrize(("index", "signature"), [(0x1010, SAVE), (0x1011, LOAD)])
def test_without_a_store_the_hardware_fails(index: int, signature: int) -> None:
    bench = Bench().boot()
    assert bench.od[index, 1].read() == 0
    with pytest.raises(SdoAbort) as refusal:
        bench.write(index, 1, signature)
    assert refusal.value.code is AbortCode.HARDWARE


def test_a_store_that_cannot_be_written_fails_and_keeps_the_old(tmp_path: Path) -> None:
    bench = configured(tmp_path / "drive.json")
    bench.write(0x1010, 1, SAVE)
    (tmp_path / ".drive.json.part").mkdir()  # where the new file would be written
    bench.write(RAMP, 0, 1)
    with pytest.raises(SdoAbort) as refusal:
        bench.write(0x1010, 1, SAVE)
    assert refusal.value.code is AbortCode.HARDWARE
    assert values(powered(tmp_path / "drive.json")) == (250, 4711)


def test_capabilities_and_signatures_by_another_implementation(tmp_path: Path) -> None:
    bench = configured(tmp_path / "drive.json")
    node = Master(bench).add_node(NODE, foreign_dictionary(bench.profile))
    assert [node.sdo[index][0].raw for index in (0x1010, 0x1011)] == [3, 3]
    assert [node.sdo[index][1].raw for index in (0x1010, 0x1011)] == [1, 1]
    node.store()
    assert values(powered(tmp_path / "drive.json")) == (250, 4711)
    node.restore()
    assert values(powered(tmp_path / "drive.json")) == defaults("cia402-full")


@pytest.mark.parametrize(
    "text", ["", "{", "[]", "7", '{"schema": "other/1"}', '{"schema": "parameters/1", "communication": {"10": "0"}}']
)
def test_a_file_of_something_else_is_named(tmp_path: Path, text: str) -> None:
    (tmp_path / "drive.json").write_text(text)
    with pytest.raises(UserError, match=r"drive\.json: no stored parameters"):
        ParameterStore(tmp_path / "drive.json")


@pytest.mark.parametrize("node_id", [0, 128, 300])
def test_a_stored_node_id_out_of_range_is_named(tmp_path: Path, node_id: int) -> None:
    store = ParameterStore(tmp_path / "drive.json")
    store.configure(node_id, 0)
    with pytest.raises(UserError, match=rf"node_id {node_id}, expected 1\.\.127"):
        ParameterStore(tmp_path / "drive.json")


def test_stored_values_that_do_not_fit_are_left_out(tmp_path: Path) -> None:
    store = ParameterStore(tmp_path / "drive.json")
    good = (4711).to_bytes(4, "little")
    values_ = {(0x2FFF, 0): good, (0x6081, 0): b"\x01", (0x605D, 0): b"\xff\x7f", (RAMP, 0): good}
    store.replace({Group.APPLICATION: values_})
    bench = powered(tmp_path / "drive.json")
    fresh = Bench().boot()
    assert bench.od[RAMP].value == 4711
    for index in (0x6081, 0x605D):
        if index in fresh.od:
            assert bench.od[index].value == fresh.od[index].value


def test_a_stored_mapping_that_is_not_possible_maps_nothing(tmp_path: Path) -> None:
    store = ParameterStore(tmp_path / "drive.json")
    store.replace({Group.COMMUNICATION: {(0x1A00, 1): (0x2FFF_0020).to_bytes(4, "little")}})
    bench = powered(tmp_path / "drive.json")
    assert bench.od[0x1A00].value == 0
    bench.nmt(b"\x01")
    assert bench.run_to(0.1) == []


# -- a kill in the middle of writing ----------------------------------------------------------------------------------

KILLS = 40
NUMBERS = [(0x6000 + index, 0) for index in range(2000)]
"""Addresses enough for a file that takes its time to write."""


def whole(path: Path) -> int:
    """The number that all stored values have; fails where the file is not whole."""
    stored = ParameterStore(path).values(Group.APPLICATION)
    assert len(stored) == len(NUMBERS)
    (number,) = {int.from_bytes(data, "little") for data in stored.values()}
    return number


def write_for_ever(path: Path) -> None:
    store, number = ParameterStore(path), 0
    while True:
        number += 1
        store.replace({Group.APPLICATION: dict.fromkeys(NUMBERS, number.to_bytes(4, "little"))})


def test_a_kill_leaves_the_old_or_the_new_file_whole(tmp_path: Path) -> None:
    path = tmp_path / "drive.json"
    ParameterStore(path).replace({Group.APPLICATION: dict.fromkeys(NUMBERS, bytes(4))})
    pause, part, parts, written = random.Random(1), tmp_path / ".drive.json.part", 0, 0
    for _ in range(KILLS):
        part.unlink(missing_ok=True)
        child = os.fork()
        if child == 0:
            try:
                write_for_ever(path)
            finally:
                os._exit(1)
        while not part.exists():
            time.sleep(0.0002)
        time.sleep(pause.uniform(0.0, 0.04))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        written += whole(path) > 0
        parts += part.exists()
    assert parts > 0, "no kill came in the middle of writing"
    assert written > 0, "no file was ever written"


def test_after_a_kill_the_drive_stores_again(tmp_path: Path) -> None:
    path = tmp_path / "drive.json"
    (tmp_path / ".drive.json.part").write_text('{"schema": "para')
    configured(path).write(0x1010, 1, SAVE)
    assert values(powered(path)) == (250, 4711)
    assert list(tmp_path.iterdir()) == [path]
