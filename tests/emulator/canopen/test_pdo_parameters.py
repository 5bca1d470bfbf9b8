"""PDO configuration: what may be mapped, and the order disable, write, enable (CiA 301, 7.5.2.35 to 7.5.2.38)."""

import pytest
from canopen_bench import NODE, Bench

from drivetwin.emulator.canopen import AbortCode, SdoAbort

INVALID = 1 << 31


def refused(bench: Bench, index: int, subindex: int, value: int) -> AbortCode:
    with pytest.raises(SdoAbort) as refusal:
        bench.write(index, subindex, value)
    return refusal.value.code


def disabled(communication: int) -> Bench:
    """A bench whose PDO does not exist and has an empty mapping."""
    bench = Bench().boot()
    bench.write(communication, 1, bench.od[communication, 1].number | INVALID)
    bench.write(communication + 0x200, 0, 0)
    return bench


@pytest.mark.parametrize("profile", ["servoone", "cia402-full"])
def test_after_power_on_pdo_1_exists_and_the_others_wait(profile: str) -> None:
    od = Bench(profile).boot().od
    for base in (0x1400, 0x1800):
        assert [od[base + number, 1].number >> 31 for number in range(4)] == [0, 1, 1, 1]
    assert od[0x1600, 1].value == 0x6040_0010
    assert od[0x1A00, 1].value == 0x6041_0010


@pytest.mark.parametrize("mapping", [0x1600, 0x1A00])
def test_the_mapping_of_an_existing_pdo_is_not_changed(mapping: int) -> None:
    bench = Bench().boot()
    assert refused(bench, mapping, 0, 0) is AbortCode.DEVICE_STATE
    assert refused(bench, mapping, 1, 0x6064_0020) is AbortCode.DEVICE_STATE


def test_an_entry_is_written_only_while_the_count_is_0() -> None:
    bench = Bench().boot()
    bench.write(0x1800, 1, 0x180 + NODE | INVALID)
    assert refused(bench, 0x1A00, 1, 0x6064_0020) is AbortCode.DEVICE_STATE
    bench.write(0x1A00, 0, 0)
    bench.write(0x1A00, 1, 0x6064_0020)


@pytest.mark.parametrize(
    ("entry", "code"),
    [
        (0x2999_0010, AbortCode.NO_SUCH_OBJECT),
        (0x6064_0120, AbortCode.NO_SUCH_SUBINDEX),
        (0x1017_0010, AbortCode.NOT_MAPPABLE),
        (0x6041_0020, AbortCode.NOT_MAPPABLE),  # not the object's length
        (0x6041_0008, AbortCode.NOT_MAPPABLE),
        (0x1008_0040, AbortCode.NOT_MAPPABLE),  # text
        (0x0005_0008, AbortCode.NO_SUCH_OBJECT),  # dummies are for RPDOs
    ],
)
def test_what_a_tpdo_may_not_carry(entry: int, code: AbortCode) -> None:
    assert refused(disabled(0x1800), 0x1A00, 1, entry) is code


@pytest.mark.parametrize(
    ("entry", "code"),
    [
        (0x6041_0010, AbortCode.NOT_MAPPABLE),  # read only
        (0x2999_0010, AbortCode.NO_SUCH_OBJECT),
        (0x0005_0010, AbortCode.NOT_MAPPABLE),
        (0x0001_0001, AbortCode.NO_SUCH_OBJECT),  # no single bits
    ],
)
def test_what_an_rpdo_may_not_carry(entry: int, code: AbortCode) -> None:
    assert refused(disabled(0x1400), 0x1600, 1, entry) is code


def test_a_mapping_longer_than_a_frame() -> None:
    bench = disabled(0x1800)
    for subindex, entry in enumerate((0x6064_0020, 0x606C_0020, 0x6041_0010), start=1):
        bench.write(0x1A00, subindex, entry)
    assert refused(bench, 0x1A00, 0, 3) is AbortCode.PDO_LENGTH
    assert refused(bench, 0x1A00, 0, 9) is AbortCode.PDO_LENGTH
    assert bench.od[0x1A00].value == 0
    bench.write(0x1A00, 0, 2)


def test_a_count_that_includes_an_unused_entry() -> None:
    bench = disabled(0x1800)
    bench.write(0x1A00, 1, 0x6064_0020)
    bench.write(0x1A00, 2, 0)
    assert refused(bench, 0x1A00, 0, 2) is AbortCode.NO_SUCH_OBJECT


@pytest.mark.parametrize("communication", [0x1400, 0x1800])
def test_the_identifier_of_an_existing_pdo_is_not_changed(communication: int) -> None:
    bench = Bench().boot()
    assert refused(bench, communication, 1, 0x1B0) is AbortCode.DEVICE_STATE
    bench.write(communication, 1, 0x1B0 | INVALID)
    bench.write(communication, 1, 0x1C0)


@pytest.mark.parametrize(
    "cob_id", [0x000, 0x07F, 0x101, 0x180, 0x581, 0x605, 0x6E0, 0x701, 0x7FF, 0x2000_0190, 0x0000_0990]
)
def test_identifiers_of_other_services_are_refused(cob_id: int) -> None:
    assert refused(disabled(0x1800), 0x1800, 1, cob_id) is AbortCode.INVALID_VALUE


@pytest.mark.parametrize(
    ("communication", "types"),
    [(0x1400, {*range(241), 254, 255}), (0x1800, {*range(241), 252, 253, 254, 255})],
)
def test_transmission_types(communication: int, types: set[int]) -> None:
    bench = Bench().boot()
    for transmission_type in range(256):
        if transmission_type in types:
            bench.write(communication, 2, transmission_type)
        else:
            assert refused(bench, communication, 2, transmission_type) is AbortCode.INVALID_VALUE


def test_the_inhibit_time_of_an_existing_pdo_is_not_changed() -> None:
    bench = Bench().boot()
    assert refused(bench, 0x1800, 3, 10) is AbortCode.DEVICE_STATE
    bench.write(0x1801, 3, 10)


def test_the_whole_sequence_by_sdo() -> None:
    bench = Bench().boot()
    for request in (
        "23 01 18 01 85 02 00 80",
        "2F 01 18 02 01 00 00 00",
        "2F 01 1A 00 00 00 00 00",
        "23 01 1A 01 20 00 64 60",
        "23 01 1A 02 20 00 A3 21",
        "2F 01 1A 00 02 00 00 00",
        "23 01 18 01 85 02 00 00",
    ):
        assert bench.sdo(request) == f"60 {request[3:11]} 00 00 00 00"
    bench.nmt(b"\x01")
    bench.od[0x6064].value = -2
    bench.od[0x21A3].value = 0.5
    bench.device.sync()
    assert bench.take() == [(0x280 + NODE, b"\xfe\xff\xff\xff\x00\x00\x00\x3f")]


def test_every_profile_maps_the_set_points_and_actual_values_of_its_streaming_mode() -> None:
    for name in ("servoone", "cia402-full"):
        bench = Bench(name).boot()
        role = bench.profile.roles["position_setpoint"]
        setpoint = role.index << 16 | role.subindex << 8 | 0x20
        bench.map_pdo(0x1400, (0x6040_0010, setpoint, 0x60B2_0010), 1)
        bench.map_pdo(0x1401, (0x60B1_0020,), 1)
        bench.map_pdo(0x1800, (0x6041_0010, 0x6077_0010, 0x606C_0020), 1)
        bench.map_pdo(0x1801, (0x6064_0020, 0x21A3_0020), 1)
