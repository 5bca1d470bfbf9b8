"""`make wafer-handler`: the machine of the paper, from kinematics to learning, through the bus into out/wafer-handler/."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from rich.console import Console

from drivetwin.controller.machine import load_machine
from drivetwin.controller.pacing import Lockstep
from drivetwin.controller.progress import Progress
from drivetwin.controller.session import Streaming, session_on
from drivetwin.drive_profiles import load_profile
from drivetwin.foundation.files import new_directory, provenance, write_json
from wafer_handler.bench import TRUTH, true_base, true_laws, virtual_arm
from wafer_handler.blade_study import BladeBench, carry_wafer, straight_move
from wafer_handler.dynamics_check import maximum_relative_difference, torque_along_a_move
from wafer_handler.kinematics_check import maximum_error
from wafer_handler.picture import draw_tracking
from wafer_handler.report import write_report
from wafer_handler.results import AXES, Study
from wafer_handler.scara.arm import load_arm
from wafer_handler.scara.excitation import DURATION
from wafer_handler.study import Recorder, bench_of, identify_through_the_bus, study_axis, study_stages
from wafer_handler.summary import print_summary

STATES = 10_000
console = Console(width=max(112, Console().width))


class Phases(Progress):
    """Says each phase as it begins."""

    def phase(self, name: str, seconds: float) -> None:
        console.print(f"  {name} ({seconds:.1f} s of motion)", highlight=False, style="dim")


def main() -> None:
    """Run the study and write it, whole or not at all."""
    parser = argparse.ArgumentParser(prog="make wafer-handler", description=__doc__)
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("out/wafer-handler"),
        help="for wafer-handler.json, report.html, tracking.png, recordings and bus logs",
    )
    parser.add_argument("--seed", type=int, default=0, help="of the exciting motion, the sensors' noise and the random states")
    parser.add_argument("--axis", action="append", choices=AXES, help="study this axis; can be repeated; without it, all")
    parser.add_argument("--together", type=float, default=DURATION, metavar="SECONDS", help="of all axes at once, at each pose")
    options = parser.parse_args()
    machine = load_machine("scara")
    inputs = [machine.model_path, machine.axes_path, TRUTH]
    with new_directory(options.out) as staged:
        study = run_study(staged, options.seed, inputs, options.axis or AXES, options.together)
        found = {"schema": "wafer-handler/1", **provenance(options.seed, inputs), **study.to_json()}
        write_json(staged / "wafer-handler.json", found)
        write_report(study, staged / "report.html")
        draw_tracking(study.axes, staged / "tracking.png")
    print_summary(console, study, options.out)


def run_study(folder: Path, seed: int, inputs: list[Path], studied: Sequence[str], together: float) -> Study:
    """The whole arm, and each axis that is `studied` by itself; recordings and bus logs go below `folder`."""
    console.print(f"kinematics and dynamics on {STATES} random states")
    dynamics, kinematics = maximum_relative_difference(seed, STATES), maximum_error(seed, STATES)
    arm, progress = load_arm(), Phases()
    virtual = virtual_arm("servoone", seed)
    recorder = Recorder(folder / "recordings" / "servoone", seed, inputs)
    console.print("servoone drives, 1 ms: P375 feeds the velocity forward, 60B2h the torque")
    log = folder / "servoone_bus.log"
    with session_on(virtual.bus, arm.machine, load_profile("servoone"), Lockstep(), None, progress, log) as session:
        identified = identify_through_the_bus(session, recorder, seed, together)
        axes = {axis: study_axis(session, axis, identified, recorder) for axis in studied}
        blade = BladeBench(bench_of(session, identified.full), virtual.witness, arm)
        straight, carried = straight_move(blade), carry_wafer(blade)
    other = virtual_arm("cia402-full", seed)
    recorder = Recorder(folder / "recordings" / "cia402-full", seed, inputs)
    streaming = Streaming(period=0.002, velocity_offset=True)
    console.print("cia402-full drives, 2 ms: 60B1h feeds the velocity forward, 60B2h the torque")
    log = folder / "cia402-full_bus.log"
    with session_on(other.bus, arm.machine, load_profile("cia402-full"), Lockstep(), None, progress, log, streaming) as session:
        by_offsets = {axis: study_stages(session, axis, identified, recorder) for axis in studied}
    return Study(
        kinematics_error=kinematics,
        dynamics=dynamics,
        compared=torque_along_a_move(),
        identified=identified.full,
        eq14=identified.eq14,
        true_base=asdict(true_base()),
        true_laws=true_laws(),
        axes=axes,
        by_offsets=by_offsets,
        straight=straight,
        carried=carried,
    )


if __name__ == "__main__":
    main()
