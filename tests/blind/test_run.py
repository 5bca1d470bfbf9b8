"""A run keeps its key sealed, loses nothing, and scores the same on any workers; with stand-ins for the slow parts."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import psutil
import pytest
from distributed import Client
from stub_diagnoser import AXIS
from stubs import DIAGNOSER, SECRET_AXIS, SECRET_SIZE, SEED, CountingWatch, Stubs

from drivetwin.blind.answer import read_answer
from drivetwin.blind.cluster import cluster
from drivetwin.blind.diagnoser_process import DiagnoserProcess
from drivetwin.blind.place import Place
from drivetwin.blind.serving import DiagnoseRequest
from drivetwin.foundation.errors import UserError

SECRETS = (SECRET_AXIS, str(SECRET_SIZE), str(SEED))
PATIENCE = 120.0


def secrets_below(*folders: Path) -> list[Path]:
    """Files that hold something which only the key may say."""
    return [path for folder in folders for path in folder.rglob("*") if any(one in content_of(path) for one in SECRETS)]


def content_of(path: Path) -> str:
    """What stands in a file; nothing where it is a folder, or is gone meanwhile."""
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except (IsADirectoryError, FileNotFoundError):
        return ""


@pytest.fixture(scope="module")
def three_workers(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """A cluster that several runs share, whose temporary files are all in one folder."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("TMPDIR", str(tmp_path_factory.mktemp("scratch")))
        with cluster(None, 3) as client:
            client.wait_for_workers(3)
            yield client


@pytest.fixture
def stubs(tmp_path: Path, three_workers: Client) -> Stubs:
    return Stubs(tmp_path, nullcontext(three_workers))


def test_one_and_three_workers_give_the_same_bytes(stubs: Stubs, tmp_path: Path) -> None:
    alone = Stubs(tmp_path / "alone", cluster(None, 1))
    alone.run(5)
    stubs.run(5)
    for name in ("score.json", "table.md", "key.json", "key.sha256"):
        assert (alone.out / name).read_bytes() == (stubs.out / name).read_bytes()
    reports = sorted(path.relative_to(stubs.out) for path in stubs.out.glob("cases/*/*/report.json"))
    assert len(reports) == 2 * 5
    assert all((alone.out / name).read_bytes() == (stubs.out / name).read_bytes() for name in reports)


def test_truth_is_on_no_disk_before_all_is_answered(stubs: Stubs) -> None:
    scratch = Path(os.environ["TMPDIR"])
    found: list[list[Path]] = []
    watch = CountingWatch(lambda _done: found.append(secrets_below(scratch, stubs.folder)))
    stubs.run(3, watch)
    assert found == [[], [], []]
    assert stubs.out / "key.json" in secrets_below(stubs.out)
    assert (stubs.out / "key.sha256").read_text(encoding="ascii").split()[0] == watch.commitment


def test_opened_key_hashes_to_what_was_told_before(stubs: Stubs) -> None:
    stubs.run(1)
    checked = subprocess.run(["sha256sum", "--check", "key.sha256"], cwd=stubs.out, capture_output=True, check=False)
    assert checked.returncode == 0


@pytest.mark.parametrize(("nominal", "model"), [("exact", "model.xml"), ("off", "model_off.xml")])
def test_diagnosing_process_is_told_nothing(stubs: Stubs, nominal: str, model: str) -> None:
    stubs.run(1)
    text = (stubs.out / "cases/000" / nominal / "seen.json").read_text(encoding="utf-8")
    seen = json.loads(text)
    assert not [secret for secret in (*SECRETS, str(stubs.folder)) if secret in text]
    assert seen["argv"] == list(DIAGNOSER)
    assert seen["cwd"] == os.sep
    assert set(seen["environ"]) <= {
        *("PATH", "HOME", "LANG", "LC_ALL", "LC_CTYPE", "TMPDIR"),
        *("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"),
    }
    assert seen["told"] == [model, "training/a", "validation/b", f"../{nominal}"]
    assert [path for path in seen["visible"] if "fresh" in path] == []


def test_fresh_motion_is_predicted_by_the_first_cause(stubs: Stubs) -> None:
    stubs.run(1)
    answer = read_answer(Place(stubs.out).outcome(0, "exact"))
    assert answer.gaps[AXIS].closed == pytest.approx(1.0 - 0.1**2)
    assert answer.fresh[AXIS].closed == pytest.approx(1.0 - 0.2**2)


def test_killed_worker_loses_no_case(stubs: Stubs) -> None:
    stubs.run(3, deadly=1)
    assert stubs.calls[1] == 2
    assert [read_answer(Place(stubs.out).outcome(number, "off")).failed for number in range(3)] == [None] * 3


def test_killed_run_goes_on_where_it_was(stubs: Stubs) -> None:
    count = 40
    command = [sys.executable, str(Path(__file__).with_name("stubs.py")), str(stubs.folder), str(count)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        deadline = time.monotonic() + PATIENCE
        while len(list(stubs.out.glob("cases/*/off/report.json"))) < 2 and time.monotonic() < deadline:
            time.sleep(0.01)
        process.send_signal(signal.SIGKILL)
        process.communicate()  # returns when the last worker has let go of the output
    finished = {int(path.parts[-3]) for path in stubs.out.glob("cases/*/off/report.json")}
    before = stubs.calls
    assert 2 <= len(finished) < count
    assert not (stubs.out / "key.json").exists()
    watch = CountingWatch()
    stubs.run(count, watch)
    assert (watch.answered, watch.examined_now) == (len(finished), count - len(finished))
    assert stubs.calls == {number: before.get(number, 0) + (number not in finished) for number in range(count)}


def test_finished_run_examines_nothing_again(stubs: Stubs) -> None:
    stubs.run(2)
    first = (stubs.out / "score.json").read_bytes()
    stubs.run(2)
    assert stubs.calls == {0: 1, 1: 1}
    assert (stubs.out / "score.json").read_bytes() == first


def test_other_cases_are_refused(stubs: Stubs) -> None:
    stubs.run(1)
    with pytest.raises(UserError, match="another --seed or --cases"):
        stubs.run(2)


def test_unfinished_answers_of_other_code_are_refused(stubs: Stubs) -> None:
    stubs.run(1)
    (stubs.out / "cases/000/off/report.json").unlink()
    with pytest.raises(UserError, match="of other code"):
        replace(stubs, code="other").run(1)


def fail(stubs: Stubs, number: int, nominal: str) -> None:
    """As if the machine of a case could not be recorded."""
    folder = stubs.out / f"cases/{number:03d}/{nominal}"
    (folder / "report.json").unlink()
    (folder / "failed.json").write_text('{"failed": "not examined: a drive tripped"}', encoding="utf-8")


def test_failed_answer_is_tried_again_but_not_by_other_code(stubs: Stubs) -> None:
    """A case that cannot be recorded must not keep newer code from scoring the others."""
    stubs.run(2)
    fail(stubs, 0, "off")
    watch = CountingWatch()
    replace(stubs, code="other").run(2, watch)
    assert watch.failed_by_other_code == 1
    assert stubs.calls == {0: 1, 1: 1}
    assert read_answer(Place(stubs.out).outcome(0, "off")).failed == "not examined: a drive tripped"
    watch = CountingWatch()
    stubs.run(2, watch)
    assert watch.failed_by_other_code is None
    assert stubs.calls == {0: 2, 1: 1}
    assert read_answer(Place(stubs.out).outcome(0, "off")).failed is None


def test_run_of_other_code_in_which_nothing_was_answered_is_refused(stubs: Stubs) -> None:
    stubs.run(1)
    for nominal in ("exact", "off"):
        fail(stubs, 0, nominal)
    with pytest.raises(UserError, match="of other code"):
        replace(stubs, code="other").run(1)


def test_foreign_folder_is_refused(stubs: Stubs) -> None:
    stubs.out.mkdir()
    (stubs.out / "letter.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(UserError, match=r"not of `drivetwin blind`"):
        stubs.run(1)


def test_running_scheduler_is_used_and_left_running(stubs: Stubs, three_workers: Client) -> None:
    assert three_workers.scheduler is not None
    replace(stubs, workers=cluster(three_workers.scheduler.address, 1)).run(2)
    assert stubs.calls == {0: 1, 1: 1}
    assert three_workers.submit(os.getpid).result() > 0


def test_absent_scheduler_is_an_error_of_the_user(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivetwin.blind.cluster._CONNECT_SECONDS", 1)
    with pytest.raises(UserError, match="no scheduler answers there"), cluster("tcp://127.0.0.1:9", 1):
        pass


def test_local_cluster_listens_on_loopback_only() -> None:
    with cluster(None, 1) as client:
        client.wait_for_workers(1)
        this = psutil.Process()
        sockets = [socket for process in (this, *this.children(recursive=True)) for socket in process.net_connections("inet")]
        listening = {socket.laddr.ip for socket in sockets if socket.status == psutil.CONN_LISTEN}
        assert listening == {"127.0.0.1"}


@pytest.mark.parametrize(
    "source", ["import drivetwin.blind.draw", "import drivetwin.controller.session", "open('/proc/1/cmdline')"]
)
def test_diagnosing_process_cannot_look_at_the_truth(tmp_path: Path, source: str) -> None:
    looking = tmp_path / "looking.py"
    looking.write_text(
        "import sys\nfrom drivetwin.blind.serving import serve\n"
        f"class Looking:\n    def diagnose(self, *_):\n        {source}\n"
        "serve(Looking(), sys.stdin, sys.stdout)\n",
        encoding="utf-8",
    )
    process = DiagnoserProcess((sys.executable, str(looking)))
    failed = process.ask(DiagnoseRequest(str(tmp_path), "model.xml", (), (), "out"))
    assert failed is not None
    assert "withheld" in failed


def test_dead_diagnosing_process_is_said_and_replaced(tmp_path: Path) -> None:
    dying = tmp_path / "dying.py"
    dying.write_text(
        "import os, sys\nfrom pathlib import Path\nfrom drivetwin.blind.serving import serve\n"
        "class Dying:\n    def diagnose(self, model, *_):\n"
        "        if not model.exists():\n            model.touch(); print('last words', flush=True); os._exit(7)\n"
        "serve(Dying(), sys.stdin, sys.stdout)\n",
        encoding="utf-8",
    )
    process = DiagnoserProcess((sys.executable, str(dying)))
    request = DiagnoseRequest(str(tmp_path), "model.xml", (), (), "out")
    failed = process.ask(request)
    assert failed is not None
    assert "status 7" in failed
    assert "last words" in failed
    assert process.ask(request) is None


def test_diagnosing_process_without_an_end_is_ended(tmp_path: Path) -> None:
    endless = tmp_path / "endless.py"
    endless.write_text("import time\nwhile True:\n    time.sleep(1.0)\n", encoding="utf-8")
    process = DiagnoserProcess((sys.executable, str(endless)), patience=0.1)
    failed = process.ask(DiagnoseRequest(str(tmp_path), "model.xml", (), (), "out"))
    assert failed is not None
    assert "status -9" in failed
