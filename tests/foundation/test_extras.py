"""A command whose libraries are of an extra says which one to install; each extra is one of the package's."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

from drivetwin.foundation.extras import EXTRA_OF, missing_extra

PROJECT = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8"))["project"]

WITHOUT_DASK = """
import sys
sys.modules["distributed"] = None
from drivetwin.cli import main
main()
"""


def test_each_library_is_of_an_extra_and_of_nothing_else() -> None:
    for module, extra in EXTRA_OF.items():
        assert any(asked.startswith(module) for asked in PROJECT["optional-dependencies"][extra])
        assert not any(asked.startswith(module) for asked in PROJECT["dependencies"])


def test_the_blind_test_without_dask_is_one_line() -> None:
    command = [sys.executable, "-c", WITHOUT_DASK, "blind", "--cases", "1"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
    assert done.stderr == (
        "drivetwin: this command needs distributed, which is not installed: pip install 'drivetwin[fleet]'\n"
    )
    assert done.returncode == 2


def test_another_missing_module_is_a_defect_and_stays_one() -> None:
    assert missing_extra(ModuleNotFoundError("No module named 'x'", name="x")) is None
    assert missing_extra(ModuleNotFoundError("without a name")) is None
