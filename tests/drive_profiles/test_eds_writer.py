"""The EDS of a drive type: the same text each time, read back equal by canopen, accepted by dcfchk."""

from __future__ import annotations

import subprocess
import venv
from dataclasses import replace
from io import StringIO
from pathlib import Path

import canopen
import pytest
from canopen.objectdictionary import ODArray, ODRecord, ODVariable, import_od
from foreign import FOREIGN

from drivetwin.drive_profiles import Access, DataType, ObjectEntry, available_profiles, load_profile
from drivetwin.drive_profiles.eds_writer import eds_access, eds_text

NODE = 7

LINES_OF_DEVICE_INFO = {
    "VendorNumber=0x16",
    "ProductNumber=0x20004",
    "RevisionNumber=0x10000",
    "BaudRate_10=0",
    "BaudRate_1000=1",
    "SimpleBootUpSlave=1",
    "NrOfRXPDO=4",
    "NrOfTXPDO=4",
    "Granularity=8",
    "LSS_Supported=0",
}


@pytest.fixture(params=available_profiles())
def profile_name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def read_back(name: str) -> canopen.ObjectDictionary:
    text = StringIO(eds_text(load_profile(name), f"{name}.eds"))
    text.name = f"{name}.eds"
    return import_od(text, NODE)


def variable(dictionary: canopen.ObjectDictionary, entry: ObjectEntry) -> ODVariable:
    found = dictionary[entry.index]
    return found if isinstance(found, ODVariable) else found[entry.subindex]


def expected_default(entry: ObjectEntry) -> int | float | str | None:
    if entry.data_type is DataType.R32:
        return None
    if entry.default_node_relative:
        assert isinstance(entry.default, int)
        return entry.default + NODE
    return entry.default


def addresses(dictionary: canopen.ObjectDictionary, index: int) -> list[tuple[int, int]]:
    entry = dictionary[index]
    return [(index, sub) for sub in ([0] if isinstance(entry, ODVariable) else entry.subindices)]


def test_canopen_reads_it_back_equal(profile_name: str) -> None:
    profile, dictionary = load_profile(profile_name), read_back(profile_name)
    listed = {address for index in dictionary if index >= 0x1000 for address in addresses(dictionary, index)}
    assert listed == {(entry.index, entry.subindex) for entry in profile.objects}
    for entry in profile.objects:
        found = variable(dictionary, entry)
        is_float = entry.data_type is DataType.R32
        assert found.name == entry.name.rpartition(".")[2]
        assert found.data_type == entry.data_type
        assert found.access_type == eds_access(entry)
        assert found.pdo_mappable == (entry.rpdo or entry.tpdo)
        assert found.default == expected_default(entry), entry
        assert (found.min, found.max) == ((None, None) if is_float else (entry.low, entry.high)), entry


def test_records_arrays_and_their_names(profile_name: str) -> None:
    dictionary = read_back(profile_name)
    for entry in load_profile(profile_name).objects:
        if "." in entry.name:
            assert isinstance(dictionary[entry.index], ODRecord | ODArray)
            assert dictionary[entry.index].name == entry.name.partition(".")[0]
    assert isinstance(dictionary[0x1018], ODRecord)
    assert isinstance(dictionary[0x1600], ODRecord)
    assert isinstance(dictionary[0x1003], ODArray)
    assert isinstance(dictionary[0x6091], ODArray)


def test_device_information(profile_name: str) -> None:
    profile, told = load_profile(profile_name), read_back(profile_name).device_information
    assert (told.vendor_number, told.product_number) == (profile.vendor_id, profile.product_code)
    assert (told.revision_number, told.product_name) == (profile.revision_number, profile.device_name)
    assert (told.nr_of_RXPDO, told.nr_of_TXPDO, told.LSS_supported) == (4, 4, profile.lss)
    assert told.allowed_baudrates == {rate * 1000 for rate in (20, 50, 125, 250, 500, 800, 1000)}


def test_device_info_of_the_servoone() -> None:
    lines = eds_text(load_profile("servoone"), "servoone.eds").splitlines()
    assert set(lines) >= LINES_OF_DEVICE_INFO


def test_the_text_is_the_same_each_time_and_ascii(profile_name: str) -> None:
    first, second = (eds_text(load_profile(profile_name), "drive.eds") for _ in range(2))
    assert first == second
    assert first.isascii()


def test_the_lists_name_every_object_once(profile_name: str) -> None:
    lines = eds_text(load_profile(profile_name), "drive.eds").splitlines()
    listed = [int(line.partition("=")[2], 16) for line in lines if line.partition("=")[0].isdigit()]
    assert sorted(listed) == sorted({entry.index for entry in load_profile(profile_name).objects})


def test_a_domain_says_nothing_of_pdos() -> None:
    """CiA 306-1, ObjectType 2h: no keyword PDOMapping; npm's `canopen` refuses a file that has it."""
    profile = load_profile("cia402-full")
    file = ObjectEntry(0x2F01, 0, "File", DataType.DOMAIN, Access.RW, False, False, "", False, None, None)
    _, _, section = eds_text(replace(profile, objects=(*profile.objects, file)), "drive.eds").partition("[2F01]\n")
    keywords = {line.partition("=")[0] for line in section.partition("\n\n")[0].splitlines()}
    assert keywords == {"ParameterName", "ObjectType", "DataType", "AccessType", "DefaultValue"}


def test_real32_defaults_and_limits_stay_empty(profile_name: str) -> None:
    sections = eds_text(load_profile(profile_name), "drive.eds").split("\n\n")
    floats = [section for section in sections if "DataType=0x0008\n" in section]
    assert floats or profile_name == "dryve_d1"
    for section in floats:
        lines = section.splitlines()
        assert {"DefaultValue=", "LowLimit=", "HighLimit="} <= set(lines)


@pytest.fixture(scope="session")
def dcfchk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """dcfchk of PyPI's dcf-tools: as `install-foreign` has installed it, or in an environment of its own."""
    if (ready := FOREIGN / "dcf-tools/bin/dcfchk").exists():
        return ready
    folder = tmp_path_factory.mktemp("dcf-tools")
    venv.create(folder, with_pip=True)
    pip = ("-m", "pip", "install", "--quiet", "--disable-pip-version-check")
    install = [str(folder / "bin/python"), *pip, "dcf-tools==2.4.2"]
    done = subprocess.run(install, capture_output=True, text=True, timeout=120, check=False)
    if done.returncode:
        pytest.skip(f"dcf-tools cannot be installed, no package registry is reachable: {done.stderr[-200:].strip()}")
    return folder / "bin/dcfchk"


def test_dcfchk_accepts_it(profile_name: str, dcfchk: Path, tmp_path: Path) -> None:
    file = tmp_path / f"{profile_name}.eds"
    file.write_text(eds_text(load_profile(profile_name), file.name), encoding="ascii")
    check = [str(dcfchk), "--node_id", str(NODE), str(file)]
    done = subprocess.run(check, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
