"""Outputs that fail: disks of every size too small, read-only, gone while a command runs. One line, and nothing half-written.

A small disk is a tmpfs in a mount namespace of the command's own (`unshare --map-root-user --mount`).
"""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from unbroken.kills import DRIVETWIN, Victim

MOUNTS = 'mount -t tmpfs -o "$0" none "$1" && shift && "$@"; status=$?; ls -A "$OUT_FOLDER" >&3; exit $status'


def can_mount() -> bool:
    """Whether this user may mount a disk that only a command of its own sees."""
    if shutil.which("unshare") is None:
        return False
    tried = subprocess.run(["unshare", "-rm", "mount", "-t", "tmpfs", "none", "/mnt"], capture_output=True, check=False)
    return tried.returncode == 0


@dataclass(frozen=True)
class Refusal:
    """How a command ended whose disk took no more: exit status, stderr, and what stands on the disk afterwards.

    `resumes`: what is left is what the next run goes on with.
    """

    status: int
    said: str
    left: tuple[str, ...]
    resumes: bool = False

    def broken(self) -> str | None:
        """What is wrong with it, if it failed."""
        if self.status == 0:
            return None
        if self.status != 2 or self.said.count("\n") != 1 or not self.said.startswith("drivetwin: "):
            return f"exit status {self.status}: {self.said[-300:]}"
        return f"left behind: {', '.join(self.left)}" if self.left and not self.resumes else None


def on_a_small_disk(victim: Victim, options: str, folder: Path) -> Refusal:
    """The command with its OUT on a tmpfs of these mount options, such as size=64k or ro, mounted at the empty `folder`."""
    words = [word.replace("OUT", str(folder / "out")) for word in victim.words]
    return replace(_within(options, folder, [*DRIVETWIN, *words]), resumes=victim.resumes)


def _within(options: str, folder: Path, command: Sequence[str]) -> Refusal:
    listing = folder.with_name(f"{folder.name}.left")
    shell = MOUNTS.replace('"$OUT_FOLDER"', f"'{folder}'").replace(">&3", f">'{listing}'")
    done = subprocess.run(
        ["unshare", "-rm", "sh", "-c", shell, options, str(folder), *command],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        check=False,
    )
    left = listing.read_text(encoding="utf-8").split()
    listing.unlink()
    return Refusal(done.returncode, done.stderr, tuple(left))
