"""MAP.yaml: which column of a foreign file is what, in which unit, and the constants of the drive (docs/import.md)."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Annotated, Literal

import yaml
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    FiniteFloat,
    PositiveFloat,
    PositiveInt,
    ValidationError,
    field_validator,
    model_validator,
)

from drivetwin.foundation.errors import UserError
from drivetwin.foundation.json_value import JsonValue
from drivetwin.foundation.text_files import parse_yaml
from drivetwin.recording.checks import check_required
from drivetwin.recording.recording import COLUMNS, DriveLoops, Positive, StartTime
from drivetwin.recording.units import Kind, canonical, quantity, unit_for

Torque = Annotated[PositiveFloat, BeforeValidator(lambda value: quantity(value, (Kind.TORQUE, Kind.FORCE)))]
Travel = Annotated[PositiveFloat, BeforeValidator(lambda value: quantity(value, (Kind.ANGLE, Kind.LENGTH)))]
Delay = Annotated[FiniteFloat, BeforeValidator(lambda value: quantity(value, (Kind.TIME,)))]
Period = Annotated[PositiveFloat, BeforeValidator(lambda value: quantity(value, (Kind.TIME,)))]


Name = Annotated[str, Field(min_length=1)]


class _Strict(BaseModel):
    """A key that is not known is a spelling mistake, and is told as one; numbers are finite."""

    model_config = ConfigDict(extra="forbid", populate_by_name=True, allow_inf_nan=False)


ObjectKey = tuple[int, int]


def _object_key(value: object) -> ObjectKey:
    """`0x6064`, `"6064h"`, `"0x21A3:1"` or (index, subindex) as that; text is hexadecimal, as in every drive manual."""
    match value:
        case (int(index), int(subindex)):
            return index, subindex
    if isinstance(value, int) and not isinstance(value, bool):
        return value, 0
    text = str(value).strip().lower()
    index_text, _, sub = text.partition(":")
    try:
        return int(index_text.removesuffix("h").removeprefix("0x"), 16), int(sub.removeprefix("0x") or "0", 16)
    except ValueError:
        raise ValueError(f"{value!r} is no object; write its index as 0x6064, with a subindex as 0x21A3:1") from None


def _object(value: object) -> ObjectKey:
    """As `_object_key`; refuses what YAML read as decimal where hexadecimal was meant."""
    # 6000 to 6999 are 1770h to 1B57h: parameters of PDOs, which no PDO carries.
    if isinstance(value, int) and 6000 <= value <= 6999:
        raise ValueError(f"{value} is read as decimal; write 0x{value}")
    return _object_key(value)


class ColumnMap(_Strict):
    """Where one column of the recording comes from; SI value = unit of `sign * (scale * raw + offset)`."""

    column: str | int | None = None
    object_: Annotated[ObjectKey, BeforeValidator(_object)] | None = Field(default=None, alias="object")
    type_: Literal["int8", "int16", "int32", "uint8", "uint16", "uint32", "float32", "float64", None] = Field(
        default=None, alias="type"
    )
    unit: str | None = None
    scale: float = 1.0
    offset: float = 0.0
    sign: Literal[1, -1] = 1
    side: Literal["joint", "motor"] = "joint"
    optional: bool = False

    @model_validator(mode="after")
    def _one_source(self) -> ColumnMap:
        if (self.column is None) == (self.object_ is None):
            raise ValueError("give one of `column` (name or number in a table) and `object` (in a bus log)")
        if not self.scale:
            raise ValueError("`scale` is 0, with which every value would be")
        return self


class AxisMap(_Strict):
    """One axis: its columns, and the constants that recording.json carries."""

    joint: str | None = None
    actuator: str | None = None
    joint_type: Literal["hinge", "slide"] = "hinge"
    rated_torque: Torque | None = None
    motor_rated_torque: Torque | None = None
    torque_constant: float | None = None
    force_constant: float | None = None
    torque_resolution: Torque | None = None
    torque_bandwidth_hz: Positive | None = None
    torque_delay: Delay | None = None
    position_resolution: Travel | None = None
    position_relative: bool = False
    encoder_increments: PositiveFloat | None = None
    user_units_per_motor_turn: PositiveFloat | None = None
    gear_ratio: PositiveFloat | None = None
    initial_position: float = 0.0
    drive: DriveLoops | None = None
    node: Annotated[int, Field(ge=1, le=127)] | None = None
    eds: Path | None = None
    columns: dict[str, ColumnMap]

    @field_validator("columns")
    @classmethod
    def _known_columns(cls, columns: dict[str, ColumnMap]) -> dict[str, ColumnMap]:
        for name, column in columns.items():
            if name not in COLUMNS:
                raise ValueError(
                    f"{name!r} is not a column of a recording;{_meant(name, COLUMNS)} one of: {', '.join(COLUMNS)}"
                )
            if column.unit is not None:
                try:
                    unit_for(name, column.unit)
                except UserError as error:
                    raise ValueError(str(error)) from None
        try:
            check_required("the map", "this axis", (name for name, column in columns.items() if not column.optional))
        except UserError:
            raise ValueError(
                "an axis needs torque, and position or velocity; without torque it needs position and position_demand; "
                "none of them `optional`"
            ) from None
        return columns

    def joint_rated_torque(self) -> float | None:
        """Rated torque [N·m or N] on the joint side, None where the map does not say."""
        if self.rated_torque is not None or self.motor_rated_torque is None:
            return self.rated_torque
        return self.motor_rated_torque * (self.gear_ratio or 1.0)


ISO = "iso"
"""Unit of a time column that holds dates and times."""


class TimeMap(_Strict):
    """The time column, or the `period` of a file that has none."""

    column: str | int | None = None
    unit: str | None = None
    period: Period | None = None

    @model_validator(mode="after")
    def _one_source(self) -> TimeMap:
        if (self.column is None) == (self.period is None):
            raise ValueError("give one of `column` (name or number) and `period` (seconds, where the file has no time)")
        if self.unit not in (None, ISO) and canonical(self.unit or "") not in ("s", "ms", "us", "ns", "min"):
            raise ValueError(f"{self.unit!r} is not a unit for time; one of: s, ms, us, ns, min, {ISO}")
        return self


_DELIMITER_NAMES = ("tab", "\\t", "whitespace", " ")


def _delimiter(text: str) -> str:
    """One character that is no part of a number or a quotation, or the name of one; raises ValueError otherwise."""
    character = len(text) == 1 and not text.isalnum() and text not in "\"'.+-" and (text.isprintable() or text == "\t")
    if not character and text not in _DELIMITER_NAMES:
        raise ValueError(f"{text!r:.40} is not a delimiter; give one character, such as ; or |, or tab, or whitespace")
    return text


class CsvLayout(_Strict):
    """How a text table is laid out; what is left out is found in the file. Rows are lines, counted from 1."""

    delimiter: Annotated[str, AfterValidator(_delimiter)] | None = None
    decimal: Literal[".", ","] | None = None
    thousands: Literal[",", ".", "'", " ", "_"] | None = None
    encoding: str | None = None
    comment: str | None = None
    header_row: Annotated[int, Field(ge=0)] | None = None
    units_row: Annotated[int, Field(ge=0)] | None = None
    first_row: PositiveInt | None = None


class BusLayout(_Strict):
    """How a bus log is read: rows are SYNC cycles."""

    eds: Path | None = None
    sync_id: Annotated[int, Field(ge=1, le=0x7FF)] = 0x80
    sync_period: Period | None = None
    grid: Literal["timestamps", "count"] = "timestamps"
    channel: str | int | None = None


class ImportMap(_Strict):
    """MAP.yaml. `path` is where it was read from; file names in it are relative to its folder."""

    machine: Name
    format: str | None = None
    time: TimeMap | None = None
    start_time: StartTime = None
    csv: CsvLayout = CsvLayout()
    bus: BusLayout = BusLayout()
    resample: Period | None = None
    gaps: Literal["refuse", "keep"] = "refuse"
    about: dict[str, JsonValue] = {}
    axes: Annotated[dict[Name, AxisMap], Field(min_length=1)]
    path: Path = Field(default=Path("map"), exclude=True)

    def beside(self, name: Path) -> Path:
        """A file named in the map, relative to the map's folder."""
        return self.path.parent / name


def read_map(path: Path) -> ImportMap:
    """Read MAP.yaml; raises UserError naming the file and the key (or line) that is wrong and what is possible."""
    try:
        payload = parse_yaml(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise UserError(f"{path} does not exist; --map names the YAML file that says which column is what") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"{path} cannot be read: {error}") from error
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = f" line {mark.line + 1} column {mark.column + 1}" if mark is not None else ""
        raise UserError(
            f"{path}{line}: not YAML: {getattr(error, 'problem', None) or error}; correct it there"
        ) from error
    if not isinstance(payload, dict):
        raise UserError(f"{path}: expected the keys machine, time and axes, got {type(payload).__name__}")
    if "path" in payload:
        raise UserError(f"{path}: path: unknown key; known keys: {', '.join(_keys(ImportMap))}")
    try:
        return ImportMap.model_validate({**payload, "path": path})
    except ValidationError as error:
        raise UserError(f"{path}: {_explain(error)}") from error


_MODELS: tuple[type[BaseModel], ...] = (ImportMap, AxisMap, ColumnMap, TimeMap, CsvLayout, BusLayout)


def _explain(error: ValidationError) -> str:
    """The first finding as `key: what is wrong; what to do`."""
    first = error.errors()[0]
    location = [str(part) for part in first["loc"]]
    key = ".".join(location)
    if first["type"] == "extra_forbidden":
        known = _keys(_model_at(location[:-1]))
        return f"{key}: unknown key;{_meant(location[-1], known)} known keys here: {', '.join(known)}"
    if first["type"] == "missing":
        return f"{key}: this key is missing; docs/import.md lists the keys"
    message = first["msg"].removeprefix("Value error, ")
    return f"{key}: {message} (got {first['input']!r:.60})" if "rror" not in first["type"] else f"{key}: {message}"


def _model_at(location: list[str]) -> type[BaseModel]:
    """The class whose keys stand at `location`: axes.NAME.columns.NAME, time, csv, bus or the top."""
    by_key: dict[str, type[BaseModel]] = {"time": TimeMap, "csv": CsvLayout, "bus": BusLayout}
    if location[:1] == ["axes"]:
        return ColumnMap if len(location) >= 4 else AxisMap
    return by_key.get(location[0], ImportMap) if location else ImportMap


def _keys(model: type[BaseModel]) -> list[str]:
    return [field.alias or name for name, field in model.model_fields.items() if name != "path"]


def _meant(name: str, known: list[str] | tuple[str, ...]) -> str:
    close = difflib.get_close_matches(name, known, n=1)
    return f" did you mean {close[0]}?" if close else ""
