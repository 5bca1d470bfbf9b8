"""Node-IDs of a machine's axes: controller and emulator both check that no two drives have the same one."""

from __future__ import annotations

from collections.abc import Mapping


def check_each_its_own(node_ids: Mapping[str, int]) -> None:
    """Raise ValueError naming the first two axes that have the same node-ID."""
    first: dict[int, str] = {}
    for axis, node_id in node_ids.items():
        if node_id in first:
            raise ValueError(f"{first[node_id]} and {axis} both have node_id {node_id}; give each its own")
        first[node_id] = axis
