"""Whatever comes over the bus, the device neither raises nor leaves the standard's states."""

from canopen_bench import NODE, Bench
from hypothesis import given, settings
from hypothesis import strategies as st

from emulator.canopen import NmtState
from emulator.canopen.lss import UNCONFIGURED

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
        bench.device.tick()
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
