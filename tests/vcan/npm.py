"""npm's `canopen` as the tests use it: a scenario of npm_canopen.js a run."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

from foreign import installed
from processes import PATIENCE

SCRIPT = Path(__file__).parent / "npm_canopen.js"


def seen(scenario: str, eds: Path, *files: Path, patience: float = PATIENCE) -> dict[str, Any]:
    """What a scenario of npm_canopen.js prints."""
    modules = installed("node_modules")
    done = subprocess.run(
        ["node", SCRIPT, scenario, eds, *files],
        capture_output=True,
        text=True,
        timeout=patience,
        check=False,
        env={**os.environ, "NODE_PATH": str(modules)},
    )
    assert (done.returncode, done.stderr) == (0, "")
    told: dict[str, Any] = json.loads(done.stdout)
    return told
