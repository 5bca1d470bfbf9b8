"""A model file in another encoding than UTF-8, which XML assumes (XML 1.0, clause 4.3.3) and MuJoCo hands on as it is."""

from __future__ import annotations

from pathlib import Path

import mujoco
import pytest

from drivetwin.foundation.errors import UserError
from drivetwin.motion.compilation import check_compiles
from drivetwin.motion.model_file import as_mjcf

MODEL = """<mujoco model="rig"><!-- Vorschub der Säge --><worldbody><body name="{body}"><joint name="{joint}" type="slide"/>
<geom size="0.1" mass="1"/></body></worldbody></mujoco>"""


def written(folder: Path, encoding: str, body: str = "carriage", joint: str = "x") -> Path:
    path = folder / "model.xml"
    path.write_bytes(MODEL.format(body=body, joint=joint).encode(encoding))
    return path


def as_text(path: Path) -> str:
    spec = mujoco.MjSpec.from_file(str(path))
    return as_mjcf(spec, spec.compile())


def test_a_comment_in_latin_1_is_one_line(tmp_path: Path) -> None:
    path = written(tmp_path, "latin-1")
    check_compiles(path)  # it is of no matter to who reads numbers
    with pytest.raises(UserError, match=r"a comment, that is not UTF-8 \(byte E4h\): save it as UTF-8"):
        as_text(path)


def test_a_comment_in_utf_8_is_kept(tmp_path: Path) -> None:
    assert "Vorschub der Säge" in as_text(written(tmp_path, "utf-8"))


@pytest.mark.parametrize("names", [{"body": "Säge"}, {"joint": "Säge"}])
def test_a_name_in_latin_1_is_one_line(names: dict[str, str], tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"model.xml has a name that is not UTF-8 \(byte E4h\): save it as UTF-8"):
        check_compiles(written(tmp_path, "latin-1", **names))


def test_a_name_in_utf_8_is_one(tmp_path: Path) -> None:
    path = written(tmp_path, "utf-8", joint="Säge")
    check_compiles(path)
    assert "Säge" in as_text(path)
