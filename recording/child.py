"""The process that reads foreign files with libraries that may crash, hang or exhaust memory on a broken file.

Run as `python -P child.py KIND FILE DIR CPU_SECONDS BYTES`: DIR then holds `arrays.npz` and `names.json`, or `error.txt`.
Nothing of the project is imported here: what the process needs is a library and NumPy.
"""

from __future__ import annotations

import json
import resource
import sys
from array import array
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

Arrays = dict[str, np.ndarray[Any, Any]]


def matlab(file: Path) -> Arrays:
    """Every numeric vector of a .mat file by its name: `t`, `run.q`, and the columns of a matrix as `X(:,2)`."""
    from scipy.io import loadmat  # noqa: PLC0415  # a log needs no SciPy

    content = loadmat(str(file), simplify_cells=True)
    return dict(_vectors("", {name: value for name, value in content.items() if not name.startswith("__")}))


def bus_log(file: Path) -> Arrays:
    """Data frames with 11-bit identifiers: `time` [s], `identifier`, `length` and `channel` (n,), `data` of all in a row."""
    import can  # noqa: PLC0415

    time, identifier, length, channel, data = array("d"), array("H"), array("B"), array("l"), bytearray()
    channels: dict[str, int] = {}
    with can.LogReader(str(file)) as reader:
        for message in reader:
            if not (message.is_error_frame or message.is_remote_frame or message.is_extended_id):
                time.append(message.timestamp)
                identifier.append(message.arbitration_id)
                length.append(len(message.data))
                channel.append(channels.setdefault(str(message.channel), len(channels)))
                data += message.data
    return {
        "time": np.array(time),
        "identifier": np.array(identifier),
        "length": np.array(length),
        "channel": np.array(channel),
        "data": np.frombuffer(data, np.uint8),
        "channels": np.array(list(channels), dtype=np.str_),
    }


READERS: dict[str, Callable[[Path], Arrays]] = {"matlab": matlab, "bus": bus_log}


def _vectors(prefix: str, value: Any) -> Iterator[tuple[str, np.ndarray[Any, Any]]]:
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _vectors(f"{prefix}.{name}" if prefix else str(name), inner)
        return
    array_ = np.squeeze(np.asarray(value))
    if array_.dtype.kind not in "buif":
        return
    if array_.ndim == 1:
        yield prefix, array_
    elif array_.ndim == 2:
        along_rows = array_.shape[0] >= array_.shape[1]
        for number in range(array_.shape[1] if along_rows else array_.shape[0]):
            name = f"{prefix}(:,{number + 1})" if along_rows else f"{prefix}({number + 1},:)"
            yield name, array_[:, number] if along_rows else array_[number]


def main(kind: str, file: str, out: str, seconds: str, size: str) -> None:
    """Read within the limits, and leave behind what was read or why it was not."""
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds) + 1))
    resource.setrlimit(resource.RLIMIT_AS, (int(size), int(size)))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        arrays = READERS[kind](Path(file))
        numbered: Any = {str(number): values for number, values in enumerate(arrays.values())}
        np.savez(Path(out, "arrays.npz"), **numbered)
        Path(out, "names.json").write_text(json.dumps(list(arrays)), encoding="utf-8")
    except Exception as error:  # noqa: BLE001  # whatever a library makes of a broken file, its reader is told
        text = "it asks for more memory than a sound file of its size" if isinstance(error, MemoryError) else str(error)
        Path(out, "error.txt").write_text(text or type(error).__name__, encoding="utf-8", errors="replace")


if __name__ == "__main__":
    main(*sys.argv[1:])
