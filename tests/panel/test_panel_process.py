"""The panel as a process: what a page is told is what the bus says, and what it may not have is refused in words."""

from __future__ import annotations

import urllib.error
import urllib.request
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from panel_bench import Page, Served, page, panel, read_by_canopen, unpacked
from processes import drivetwin, emulator
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin

from drivetwin.bus.channel import open_bus


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with panel("--allow-writes") as found:
        yield found


@pytest.fixture
def looking(served: Served) -> Iterator[Page]:
    with page(served) as found:
        yield found


def streams(node: dict[str, Any]) -> bool:
    """Homed, and in interpolated position mode."""
    return bool(node["state"] == "Operation enabled" and node["mode"] == 7)


def test_the_machine_is_in_motion(looking: Page) -> None:
    looking.ask("watch", view="drives")
    first = looking.until(lambda told: all(streams(node) for node in told["nodes"]))
    before = [node["joint"] for node in first["nodes"]]
    later = looking.until(
        lambda told: all(abs(node["joint"] - start) > 0.02 for node, start in zip(told["nodes"], before, strict=True))
    )
    assert [(node["id"], node["name"], node["unit"]) for node in later["nodes"]] == [
        (1, "lift", "m"),
        (2, "rotate", "rad"),
        (3, "stretch", "rad"),
    ]
    assert all(node["nmt"] == "operational" for node in later["nodes"])
    assert later["motion"] == {"runs": True, "said": ""}


def test_a_foreign_master_reads_what_a_page_wrote(served: Served, looking: Page) -> None:
    assert looking.ask("write", node=2, index=0x2184, subindex=0, value="1.25")["answer"] == 1.25
    assert read_by_canopen(served.bus, 2, 0x2184) == 1.25
    assert looking.ask("read", node=2, index=0x2184, subindex=0)["answer"] == 1.25


@pytest.mark.parametrize(
    ("more", "why"),
    [
        ({"index": 0x6041, "subindex": 0, "value": "1"}, "is ro: it cannot be written"),
        ({"index": 0x2172, "subindex": 0, "value": "7"}, "outside 0 to 2"),
        ({"index": 0x5000, "subindex": 0, "value": "7"}, "have no 5000h:00"),
        ({"index": 0x1A00, "subindex": 1, "value": "0x60640020"}, "the drive refused"),
        ({"index": 0x1A00}, "Field required"),
    ],
)
def test_what_cannot_be_written_is_refused(looking: Page, more: dict[str, object], why: str) -> None:
    assert why in looking.ask("write", node=1, **more)["refused"]


def test_a_second_writer_is_refused_until_the_first_lets_go(served: Served, looking: Page) -> None:
    write = {"node": 1, "index": 0x2184, "subindex": 0, "value": "0.5"}
    assert looking.ask("write", **write)["answer"] == 0.5
    with page(served) as second:
        assert "another page writes since" in second.ask("write", **write)["refused"]
        assert second.ask("read", node=1, index=0x2184, subindex=0)["answer"] == 0.5
        looking.ask("release")
        assert second.ask("write", **write)["answer"] == 0.5
        assert "another page writes since" in looking.ask("write", **write)["refused"]


def test_the_pen_is_free_when_its_page_has_left(served: Served, looking: Page) -> None:
    with page(served) as first:
        first.ask("write", node=1, index=0x2184, subindex=0, value="0")
    looking.ask("watch", view="drives")
    looking.until(lambda told: told["pen"]["writer"] == "nobody")
    assert looking.ask("write", node=1, index=0x2184, subindex=0, value="0")["answer"] == 0


def test_a_page_of_another_origin_is_refused(served: Served) -> None:
    with pytest.raises(InvalidStatus) as refused, connect(f"ws://{served.host}/live", origin=Origin("http://example.org")):
        pass
    assert refused.value.response.status_code == 403
    assert b"a page of http://example.org may not ask this panel" in (refused.value.response.body or b"")
    asked = urllib.request.Request(served.url, headers={"Origin": "http://example.org"})
    with pytest.raises(urllib.error.HTTPError, match="403"):
        urllib.request.urlopen(asked)


def test_a_page_loads_nothing_from_elsewhere(served: Served) -> None:
    with urllib.request.urlopen(served.url) as answer:
        assert answer.headers["content-security-policy"].startswith("default-src 'self'")


def test_what_is_no_question_is_refused(looking: Page) -> None:
    assert "does not match any of the expected tags" in looking.ask("format everything")["refused"]
    assert "there is no node 9" in looking.ask("read", node=9, index=0x1000, subindex=0)["refused"]


def test_an_emulator_of_somebody_else_is_looked_at_and_not_written() -> None:
    profile = ("--profile", "cia402-full")
    with emulator("--machine", "stage", *profile) as bus, panel("--bus", bus, *profile) as served, page(served) as looking:
        looking.ask("watch", view="drives")
        told = looking.until(lambda told: all(node["state"] for node in told["nodes"]))
        assert {node["state"] for node in told["nodes"]} == {"Switch on disabled"}
        assert told["motion"] is None
        for what, more in WRITES:
            assert "--allow-writes" in looking.ask(what, **more)["refused"]


WRITES: list[tuple[str, dict[str, object]]] = [
    ("write", {"node": 1, "index": 0x6060, "subindex": 0, "value": "1"}),
    ("nmt", {"node": 1, "name": "Start"}),
    ("command", {"node": 1, "name": "Shutdown"}),
    ("store", {"node": 1}),
    ("motion", {"runs": True}),
    ("strike", {"told": {"fault": "sto", "node": 1}, "seconds": None}),
    ("end", {"told": {"fault": "sto", "node": 1}}),
]


def test_a_port_in_use_is_one_line(served: Served) -> None:
    port = served.host.rpartition(":")[2]
    ended = drivetwin("panel", "--port", port)
    assert ended.status == 2
    assert ended.err.startswith(f"drivetwin: cannot listen on 127.0.0.1:{port} (Address already in use")
    assert ended.err.count("\n") == 1


def test_a_panel_beside_its_emulator_takes_no_turn_on_a_drives_sdo_channel(served: Served, looking: Page) -> None:
    """With no other master on the bus, every SDO request would be the panel's. A drive has one channel, for one client."""
    looking.ask("motion", runs=False)
    show(looking, "2:6079:00", "3:6079:00")
    bus = open_bus(served.bus)
    try:
        looking.ask("watch", view="scope")
        looking.until(lambda told: len(told["channels"]) == 2 and all(each["last"] for each in told["channels"]))
        assert looking.ask("write", node=2, index=0x2184, subindex=0, value="0.75")["answer"] == 0.75
        for _ in range(50):
            looking.until(lambda _: True)
            assert looking.ask("read", node=2, index=0x1018, subindex=1)["answer"] is not None
        passed = [message.arbitration_id for message in iter(lambda: bus.recv(0.0), None)]
    finally:
        bus.shutdown()
        looking.ask("motion", runs=True)
    assert passed.count(0x80) > 10
    assert not [cob_id for cob_id in passed if 0x581 <= cob_id <= 0x67F]


def test_a_physical_bus_is_not_emulated_on() -> None:
    assert "leave --emulate out" in drivetwin("panel", "--port", 0, "--emulate", "scara", "--bus", "can0").err


def show(looking: Page, *channels: str, **more: object) -> dict[str, Any]:
    """The answer of the scope to what it shall show."""
    settings = {"window": 1.0, "pre": 0.5, "trigger": None, "xy": None} | more
    return looking.ask("scope set", channels=list(channels), **settings)


def test_the_scope_shows_bus_and_truth_alike(looking: Page) -> None:
    """6064h of a drive by PDO, its supply voltage by SDO, and what the plant does."""
    looking.ask("watch", view="drives")
    looking.until(lambda told: all(streams(node) for node in told["nodes"]))
    assert show(looking, "2:6064:00", "2:6079:00", "truth:rotate:position", "truth:rotate:velocity")["answer"] is None
    looking.ask("watch", view="scope")
    told = looking.until(lambda told: len(told.get("channels", ())) == 4 and all(each["last"] for each in told["channels"]))
    assert [(each["source"], each["unit"]) for each in told["channels"]] == [
        ("PDO", "rad"),
        ("SDO", "mV"),
        ("truth", "rad"),
        ("truth", "rad/s"),
    ]
    assert told["channels"][0]["last"] == pytest.approx(told["channels"][2]["last"], abs=0.2)
    drawn = unpacked(told["picture"]["values"]["2:6064:00"])
    assert drawn.shape == (told["picture"]["points"],)
    assert drawn[~np.isnan(drawn)][-1] == pytest.approx(told["channels"][0]["last"], abs=0.2)


def test_the_scope_triggers_and_holds(served: Served, looking: Page) -> None:
    looking.ask("watch", view="scope")
    assert show(looking, "2:6064:00", trigger={"channel": "2:6064:00", "kind": "rises", "level": 0.0})["answer"] is None
    held = looking.until(lambda told: told["state"] == "triggered" and told["set"]["trigger"] is not None)
    span = held["picture"]
    assert (span["start"], span["end"]) == pytest.approx((held["fired"] - 0.5, held["fired"] + 0.5))
    drawn = unpacked(span["values"]["2:6064:00"])
    values = drawn[~np.isnan(drawn)]
    assert values[0] < 0.0 < values[-1]
    finer = looking.ask("scope zoom", start=held["fired"] - 0.01, end=held["fired"] + 0.01)["answer"]
    assert finer["end"] - finer["start"] == pytest.approx(0.02)
    with urllib.request.urlopen(f"{served.url}scope.csv") as answer:
        head, *rows = answer.read().decode().splitlines()
    assert head == "time [s],rotate Position actual value (2:6064:00) [rad]"
    assert len(rows) == pytest.approx(250, abs=2)
    with pytest.raises(urllib.error.HTTPError, match="409") as refused:
        urllib.request.urlopen(f"{served.url}scope.zip")
    assert b"without its torque" in refused.value.read()


def test_a_scope_does_not_show_everything(looking: Page) -> None:
    assert "a scope has 12 at most" in show(looking, *(f"1:60{number:02X}:00" for number in range(13)))["refused"]
    assert "add it first" in show(looking, "1:6064:00", xy=("1:6064:00", "1:606C:00"))["refused"]


def test_a_page_that_stops_reading_costs_nobody_a_frame(served: Served, looking: Page) -> None:
    """A page that watches the scope and reads nothing: the other one is told on, in order, and answered."""
    with page(served) as deaf:
        deaf.wire.send('{"id": 1, "ask": "watch", "view": "scope"}')
        show(looking, "1:6064:00", "2:6064:00", "3:6064:00", window=60.0)
        looking.ask("watch", view="scope")
        ends = [looking.until(lambda _: True)["picture"]["end"] for _ in range(200)]
        assert ends == sorted(ends)
        assert looking.ask("read", node=1, index=0x1000, subindex=0)["answer"] is not None
