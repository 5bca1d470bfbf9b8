"""Whatever comes over the bus, the device neither raises nor leaves the standard's states.

Here one device by itself, and a small share of scripts/fuzz.py, which does the same with three drives and their plant;
`make test-long` runs more, `make fuzz` all of it.
"""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from canopen_bench import NODE, Bench
from hypothesis import given, settings
from hypothesis import strategies as st
from repeats import LONG

from drivetwin.emulator.canopen import NmtState
from drivetwin.emulator.canopen.lss import UNCONFIGURED

ADDRESSED = st.sampled_from(
    [0x000, 0x080, 0x100, 0x200 + NODE, 0x300 + NODE, 0x180 + NODE, 0x600 + NODE, 0x700 + NODE, 0x701, 0x7E5]
)
SDO_TARGETS = st.sampled_from(
    [*range(0x1000, 0x101A), 0x1029, 0x1400, 0x1600, 0x1800, 0x1A00, 0x6040]  # some of them do not exist
)


@st.composite
def sdo_request(draw: st.DrawFn) -> tuple[int, bytes, bool]:
    head = bytes((draw(st.integers(0, 255)),)) + draw(SDO_TARGETS).to_bytes(2, "little")
    return 0x600 + NODE, head + bytes((draw(st.integers(0, 8)),)) + draw(st.binary(min_size=4, max_size=4)), False


@st.composite
def lss_request(draw: st.DrawFn) -> tuple[int, bytes, bool]:
    command = draw(st.sampled_from([0x04, 0x11, 0x13, 0x15, 0x17, *range(0x40, 0x44), *range(0x46, 0x4D), 0x51, 0x5A, 0x5E]))
    return 0x7E5, bytes((command, draw(st.sampled_from([0, 1, 5, 9, 255])))) + draw(st.binary(min_size=6, max_size=6)), False


ANY_FRAME = st.tuples(st.one_of(ADDRESSED, st.integers(0, 0x7FF)), st.binary(max_size=8), st.booleans())


@settings(max_examples=300, deadline=None)
@given(st.lists(st.one_of(ANY_FRAME, sdo_request(), lss_request()), max_size=40))
def test_no_frame_raises(frames: list[tuple[int, bytes, bool]]) -> None:
    bench = Bench().operational()
    for cob_id, data, remote in frames:
        if cob_id == bench.device.sync_cob_id:
            bench.device.sync()
        else:
            bench.device.receive(cob_id, data, remote)
        bench.time += 1e-3
        bench.device.tick(bench.time)
    if bench.device.node_id == UNCONFIGURED:
        assert bench.device.nmt.state is NmtState.INITIALISING
    else:
        assert bench.device.nmt.state in (NmtState.PRE_OPERATIONAL, NmtState.OPERATIONAL, NmtState.STOPPED)
    for cob_id, data in bench.take():
        assert 0 < cob_id <= 0x7FF
        assert len(data) <= 8
    for variable in bench.od:
        if variable.size is not None and variable.on_read is None:
            variable.check(variable.read())


SCRIPT = Path(__file__).parents[3] / "scripts" / "fuzz.py"
FRAMES = 8_000 if LONG else 2_000
PATIENCE = 600.0


def test_a_share_of_the_fuzz_of_a_whole_machine(tmp_path: Path) -> None:
    """Both drive types, another seed than `make fuzz`; the script ends with 1 where a rule is broken."""
    command = [sys.executable, str(SCRIPT), "--frames", str(FRAMES), "--seed", "402", "--out", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count(f"{FRAMES // 2} random and mutated frames among") == 2
    assert not list(tmp_path.iterdir())


BROKEN = {
    "a transition that there is not": (
        "import drivetwin.emulator.drive.state_machine as m",
        "m._AT_ONCE[m.State.SWITCH_ON_DISABLED, m.Command.ENABLE_OPERATION] = m.State.OPERATION_ENABLED",
        "switch on disabled -> operation enabled by",
    ),
    "an NMT command of a wrong length": (
        "import drivetwin.emulator.canopen.nmt as m; receive = m.Nmt.receive",
        "m.Nmt.receive = lambda self, data: receive(self, data[:2])",
        "by no NMT command",
    ),
    "an answer of a node that is stopped": (
        "import drivetwin.emulator.canopen.nmt as m",
        "m.Nmt.communicating = property(lambda self: True)",
        "a frame that no drive may send now",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_the_fuzz_finds_what_is_broken(name: str, tmp_path: Path) -> None:
    """Each rule of its judge, by an emulator that breaks it; the last frames are left for who looks into it."""
    reach, spoil, said = BROKEN[name]
    run = f"import sys; sys.path.insert(0, {str(SCRIPT.parent)!r}); {reach}; {spoil}; import fuzz; fuzz.main()"
    command = [sys.executable, "-c", run, "--frames", "6000", "--seed", "3", "--out", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 1
    assert re.search(said, done.stdout), done.stdout
    log = next(iter(sorted(tmp_path.glob("*_seed3.log"))))
    frames = log.read_text(encoding="ascii").splitlines()
    assert 100 <= len(frames) <= 200
    assert all(re.fullmatch(r"\(\d+\.\d{6}\) can0 ([0-9A-F]{3}|[0-9A-F]{8})#.*|.* # a cycle passes", line) for line in frames)
