"""A file of findings, identified.json or effects.json, applied to a model; the file's schema decides which it is."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from drivetwin.emulator.effects import read_effects
from drivetwin.foundation.errors import UserError
from drivetwin.foundation.text_files import parse_json
from drivetwin.identification.identified_file import read_identified
from drivetwin.motion.inverse_dynamics import load_model
from drivetwin.twin.apply import Applied, apply_effects, joints_of
from drivetwin.twin.identified import identified_effects


def apply_findings(findings: Path, model: Path, given: Mapping[str, str]) -> Applied:
    """The model with what the file tells in it; `given`: joints of axes that have another name.

    Raises UserError for a file of another kind, an axis without a joint, and a value that the model cannot have.
    """
    if _schema(findings).startswith("identified/"):
        found, machine = read_identified(findings), load_model(model)
        joints = joints_of(model, list(found.axes), {**found.joints, **given})
        found = found.on(joints)
        return apply_effects(model, joints, identified_effects(findings, found, machine))
    effects = read_effects(findings)
    joints = joints_of(model, list(dict.fromkeys(placed.axis for placed in effects)), given)
    return apply_effects(model, joints, effects)


def _schema(path: Path) -> str:
    try:
        content = parse_json(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"{path} cannot be read: {error.strerror}; give identified.json or effects.json") from None
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise UserError(f"{path} is not JSON: {error}; give identified.json or effects.json") from None
    schema = content.get("schema") if isinstance(content, dict) else None
    if not isinstance(schema, str) or schema not in ("identified/1", "effects/1"):
        beside = path.with_name("effects.json")
        advice = f"; give {beside}" if beside != path and beside.is_file() else ""
        raise UserError(f"{path}: schema is {schema!r:.80}; expected 'identified/1' or 'effects/1'{advice}")
    return schema
