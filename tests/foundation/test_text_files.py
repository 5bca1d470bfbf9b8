"""JSON and YAML of strangers: what no parser survives by itself ends in the parser's own error."""

from __future__ import annotations

import json
import logging
from pathlib import Path

import pytest
import yaml

from drivetwin.bus.unix_bus import socket_path
from drivetwin.cli import LineFormatter, main
from drivetwin.foundation.errors import LONGEST, UserError
from drivetwin.foundation.text_files import parse_json, parse_yaml
from drivetwin.recording.import_map import read_map

DIGITS = "9" * 5000


@pytest.mark.parametrize("text", ['{"a": [1, -2.5e3, null, "x"]}', "[]", "true", "1" * 300])
def test_json_is_json(text: str) -> None:
    assert parse_json(text) == json.loads(text)


def test_a_warning_is_one_printable_line() -> None:
    record = logging.LogRecord("reader", logging.WARNING, "file", 1, "%s is ignored", ("a\x1b[2J\nb",), None)
    assert LineFormatter().format(record) == r"WARNING reader: a\x1b[2J b is ignored"


@pytest.mark.parametrize("text", ["", "{,", DIGITS, f"[-{DIGITS}]", "[" * 100_000, '{"a":' * 100_000])
def test_json_that_is_none(text: str) -> None:
    with pytest.raises(json.JSONDecodeError):
        parse_json(text)


@pytest.mark.parametrize("text", ["", "a: [1, 0x10, 2.5, ~]", "&x {a: 1, b: [1, 2]}", "a: &x [1]\nb: *x\nc: {<<: {d: 1}}"])
def test_yaml_is_yaml(text: str) -> None:
    assert parse_yaml(text) == yaml.safe_load(text)


LAUGHS = "a0: &a0 [x, x]\n" + "".join(f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}]\n" for n in range(1, 60))


@pytest.mark.parametrize(
    "text",
    [
        *("{", "a: b: c", "a: 2026-13-45"),
        *(f"a: {DIGITS}", f"a: 0x{'f' * 5000}", "- " * 5000, "a: !!bool x", "a: !!timestamp x"),
        *("a: &a [*a]", "? [a]\n: 1", "a: !!python/object:os.system {}", "a: *missing", "\0", "#" * 300_001),
        *(LAUGHS, "a: 1\n---\nb: 2"),
    ],
)
def test_yaml_that_is_none(text: str) -> None:
    with pytest.raises(yaml.YAMLError):
        parse_yaml(text)


def test_a_map_says_where_it_is_not_yaml(tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_text(f"machine: x\ntime: {{period: {DIGITS}}}\n")
    with pytest.raises(UserError, match=r"map\.yaml: not YAML: line 2: a number has 5000 digits"):
        read_map(tmp_path / "map.yaml")


def test_a_message_is_one_printable_line() -> None:
    message = str(UserError("column \x1b[31m'M'\x00\n\ttwice\u202e\ud800 of µm·s"))
    assert message == r"column \x1b[31m'M'\x00 twice\u202e\ud800 of µm·s"


def test_a_long_message_keeps_its_beginning_and_what_to_do() -> None:
    message = str(UserError("file: key " + "x" * 100_000 + "; correct that key"))
    assert len(message) <= LONGEST
    assert message.startswith("file: key x")
    assert message.endswith("x; correct that key")


def test_a_bus_name_with_a_zero_byte() -> None:
    with pytest.raises(UserError, match=r"unix:/tmp/a\\x00b: a path has no zero byte"):
        socket_path("unix:/tmp/a\0b")


def test_what_the_operating_system_says_is_one_printable_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["drivetwin", "fit", str(tmp_path / "a\x1b[2J.xml"), "x", "--out", str(tmp_path / "out")])
    with pytest.raises(SystemExit):
        main()
    assert capsys.readouterr().err.removesuffix("\n").isprintable()
