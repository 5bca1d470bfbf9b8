"""What MuJoCo's XML parser says, in words."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.motion.mjcf_fault import fault


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<mujoco>\n<body>\n</mujoco>", "line 2: an element is not closed, or is closed by another name"),
        ("<mujoco>\n<worldbody a=1/>\n</mujoco>", "line 2: an attribute cannot be read"),
    ],
)
def test_a_file_that_is_no_xml_is_told_by_line_and_in_words(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "model.xml"
    path.write_text(text, encoding="utf-8")
    told = fault(str(path))
    assert told.startswith(f"is not a MuJoCo model: {said}")
    assert "ErrorID" not in told
