"""All settings: one nested, frozen model, a section for each stage, every value with its unit and its reason.

A stage imports only its own section from here. This module imports nothing heavier than pydantic.
"""

from __future__ import annotations

import difflib
import json
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from scan2bim.errors import UsageError, reason

UNITS: Mapping[str, float] = {
    "m": 1.0,
    "dm": 0.1,
    "cm": 0.01,
    "mm": 0.001,
    "km": 1000.0,
    "in": 0.0254,
    "ft": 0.3048,
    "us-ft": 1200.0 / 3937.0,
}
"""Metres in one unit. ``us-ft`` is the US survey foot, 2e-6 longer than the international one: 1 m in 500 km."""

Up = Literal["x", "y", "z", "-x", "-y", "-z"]


class Section(BaseModel):
    """Frozen, and refuses keys that it does not know."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class FrameSettings(Section):
    """How coordinates of the files become metres with z up."""

    unit: str | None = Field(
        default=None,
        description="Unit of the files' coordinates (m, dm, cm, mm, km, in, ft, us-ft); unset: what the file states, "
        "else what makes storey heights of 2 to 6 m.",
    )
    up: Up | None = Field(
        default=None,
        description="Axis of the files that points up (x, y, z, -x, -y, -z); unset: the axis along which points "
        "pile up in floors and ceilings.",
    )

    @field_validator("unit")
    @classmethod
    def _known_unit(cls, value: str | None) -> str | None:
        if value is not None and value not in UNITS:
            raise ValueError(f"expected one of {', '.join(UNITS)}")
        return value

    @property
    def metres_per_unit(self) -> float | None:
        """Metres in one unit of the files, None where it is to be found out."""
        return None if self.unit is None else UNITS[self.unit]


class ReadSettings(Section):
    """The one pass over the points: tiles and depth panoramas."""

    panorama_edge: int = Field(
        default=448,
        ge=48,
        le=2048,
        description="Most cells along an edge of a station's cube-map panorama; 448: 0.2 degrees, 2 cm at 5 m, 2.4 MB.",
    )


class SurfelSettings(Section):
    """Merging the scans' tiles to surface elements."""


class StructureSettings(Section):
    """Storeys, wall faces, spaces, walls, slabs."""


class OpeningSettings(Section):
    """Doors, windows and passages."""

    method: Literal["full", "paper"] = Field(
        default="full",
        description="How openings are found: full = all evidence of both wall faces is fused; paper = closed doors by "
        "the founding paper's section V on each face alone, open ones without their leaves.",
    )
    paper_grid: int = Field(default=20, ge=2, le=200, description="Rows and columns of the grid of sample patches.")
    paper_patch: int = Field(default=5, ge=3, le=51, description="Edge of a sample patch, pixels of 1 cm; odd.")
    paper_deviation: float = Field(
        default=0.20, gt=0, le=1, description="Deviation of a component (of 1) above which a patch is not coherent."
    )
    paper_silhouette: float = Field(
        default=0.7, ge=-1, le=1, description="Silhouette from which on a patch is consistent with its cluster."
    )
    paper_dominant: float = Field(
        default=0.55, ge=0, le=1, description="Share of a door (alpha 1) of its dominant colour and dominant depth."
    )
    paper_outline: float = Field(
        default=0.70, ge=0, le=1, description="Share of each side (alpha 2) that discontinuities must support."
    )
    paper_wall: float = Field(
        default=0.03, ge=0, le=1, description="Share of a door (alpha 3) that may be the wall's own area."
    )
    paper_least_width: float = Field(default=0.6, gt=0, description="Least width of a door, metres.")
    paper_most_width: float = Field(default=2.4, gt=0, description="Largest width of a door, metres: two leaves.")
    paper_least_height: float = Field(default=1.8, gt=0, description="Least height of a door, metres.")
    paper_most_height: float = Field(default=2.6, gt=0, description="Largest height of a door, metres.")


class VerifySettings(Section):
    """Model against scans."""

    tolerance: float = Field(
        default=0.015,
        gt=0,
        le=0.15,
        description="Deviation (m) up to which an element is in tolerance; 0.015: LOA30, usual for as-built work.",
    )
    classes: tuple[str, ...] = Field(
        default=(),
        description='Other tolerances for classes, as ["IfcColumn=0.01", "IfcSlab=0.02"], metres.',
    )

    @field_validator("classes")
    @classmethod
    def _class_tolerances(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        for entry in value:
            name, _, metres = entry.partition("=")
            if not name.strip().startswith("Ifc") or not _is_length(metres):
                raise ValueError('expected entries such as "IfcColumn=0.01" (metres, up to 0.15)')
        return value

    def tolerance_of(self, ifc_class: str) -> float:
        """Metres, for an element of a class; IfcWall stands for IfcWallStandardCase too."""
        own = {name.strip().lower(): float(metres) for name, _, metres in (e.partition("=") for e in self.classes)}
        return next((own[name] for name in _names_of(ifc_class) if name in own), self.tolerance)

    def unused_classes(self, present: Iterable[str]) -> tuple[str, ...]:
        """Classes with a tolerance of their own of which a model with elements of the classes ``present`` has none."""
        known = {name for ifc_class in present for name in _names_of(ifc_class)}
        names = (entry.partition("=")[0].strip() for entry in self.classes)
        return tuple(name for name in names if name.lower() not in known)


def _names_of(ifc_class: str) -> tuple[str, str]:
    """What a class may be called in ``VerifySettings.classes``, in lower case."""
    name = ifc_class.lower()
    return name, name.removesuffix("standardcase")


def _is_length(text: str) -> bool:
    try:
        return 0 < float(text) <= 0.15
    except ValueError:
        return False


class ExportSettings(Section):
    """The output files."""

    ifc_version: Literal["IFC2X3", "IFC4", "IFC4X3_ADD2"] = Field(
        default="IFC4",
        description="Version of .ifc files: IFC4 = read by most tools; IFC4X3_ADD2 = the newest, with uncertainties; "
        "IFC2X3 = for older authoring tools.",
    )


class Settings(Section):
    """All settings of a conversion or verification."""

    frame: FrameSettings = FrameSettings()
    read: ReadSettings = ReadSettings()
    surfels: SurfelSettings = SurfelSettings()
    structure: StructureSettings = StructureSettings()
    openings: OpeningSettings = OpeningSettings()
    verify: VerifySettings = VerifySettings()
    export: ExportSettings = ExportSettings()


def load_settings(path: Path | None = None, overrides: Mapping[str, Mapping[str, object]] | None = None) -> Settings:
    """Settings from a TOML file, or the defaults, with single values overridden by section and name.

    Raises UsageError naming the file, the key, what was expected and what came.
    """
    values: dict[str, Any] = _read_toml(path) if path else {}
    for section, entries in (overrides or {}).items():
        if isinstance(values.get(section, {}), dict):
            values[section] = {**values.get(section, {}), **entries}
    try:
        return Settings.model_validate(values)
    except ValidationError as error:
        where = f"{path}: " if path else ""
        raise UsageError("\n".join(f"{where}{line}" for line in _explain(error))) from None


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise UsageError(f"{path}: no such settings file. Pass an existing TOML file to --config.") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"{path}: the settings file cannot be read ({reason(error)}).") from None
    except tomllib.TOMLDecodeError as error:
        raise UsageError(
            f"{path}: not a TOML file: {error}. Expected sections such as [frame] with key = value."
        ) from None


def _explain(error: ValidationError) -> Iterator[str]:
    for problem in error.errors():
        place = [str(part) for part in problem["loc"]]
        key = ".".join(place)
        if problem["type"] == "extra_forbidden":
            yield f"unknown setting {key!r}. {_suggestion(place)}"
        else:
            message = problem["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
            came = json.dumps(problem["input"], default=str)
            expected = message if message.startswith("expected") else f"expected {message}"
            yield f"setting {key!r}: {expected}, but got {came}."


def _suggestion(place: list[str]) -> str:
    """The known name that is nearest to the unknown one, else all known names of its section."""
    section = _section(place[:-1])
    known = list(section.model_fields) if section else []
    everywhere = {f"{s}.{name}" for s in Settings.model_fields for name in _fields(s)}
    near = difflib.get_close_matches(place[-1], known, n=1, cutoff=0.6)
    if near:
        return f"Did you mean {'.'.join([*place[:-1], near[0]])!r}?"
    elsewhere = [name for name in everywhere if name.partition(".")[2] == place[-1]]
    if elsewhere:
        return f"Did you mean {min(elsewhere)!r}?"
    if not known:
        return f"This section has no settings. Known are: {', '.join(sorted(everywhere))}."
    return f"Known here: {', '.join(known)}."


def _section(place: list[str]) -> type[BaseModel] | None:
    model: type[BaseModel] = Settings
    for part in place:
        inner = model.model_fields[part].annotation if part in model.model_fields else None
        if not (isinstance(inner, type) and issubclass(inner, BaseModel)):
            return None
        model = inner
    return model


def _fields(section: str) -> list[str]:
    model = _section([section])
    return list(model.model_fields) if model else []


def settings_toml(settings: Settings) -> str:
    """The settings as TOML that ``load_settings`` reads back, each with its description as a comment."""
    lines = ["# Settings of this conversion. Pass this file to --config to use them again.", ""]
    for section in Settings.model_fields:
        values: BaseModel = getattr(settings, section)
        lines.append(f"[{section}]")
        for name, info in type(values).model_fields.items():
            lines.append(f"# {info.description or name}")
            lines.append(_toml_line(name, getattr(values, name)))
        lines.append("")
    return "\n".join(lines)


def _toml_line(name: str, value: object) -> str:
    if value is None:
        return f"# {name} ="
    if isinstance(value, tuple):
        return f"{name} = [{', '.join(_toml_value(item) for item in value)}]"  # pyright: ignore[reportUnknownVariableType]
    return f"{name} = {_toml_value(value)}"


def _toml_value(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)
    # A JSON string is a TOML basic string, as long as nothing outside the basic plane is escaped in pairs.
    return json.dumps(str(value), ensure_ascii=False)
