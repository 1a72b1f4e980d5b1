"""Findings as BCF 3.0: a zip of XML with a topic, a viewpoint and a snapshot for each."""

from __future__ import annotations

import math
import uuid
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]

AUTHOR = "scan2bim"
TYPE = "Deviation"
LABELS = ("out of tolerance", "missing", "addition")
DATE = (1980, 1, 1, 0, 0, 0)
"""Of the zip's entries: the same findings make the same file."""
DISTANCE = 2.2
"""Of the camera from what it looks at, in half-diagonals of its box: all of it is in view at 60 degrees."""


@dataclass(frozen=True, slots=True, eq=False)
class Topic:
    """A finding: key (stable), title, description, label, GlobalIds to select, box (2, 3) in the model's axes, PNG."""

    key: str
    title: str
    description: str
    label: str
    guids: tuple[str, ...]
    box: F64
    snapshot: bytes


def write_bcf(topics: Sequence[Topic], path: Path, project: str, date: str) -> None:
    """Write all topics; ``date`` (ISO 8601) is that of their creation."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        _add(file, "bcf.version", '<Version VersionId="3.0"/>')
        identity = _uuid(project)
        _add(
            file,
            "project.bcfp",
            f'<ProjectInfo><Project ProjectId="{identity}"><Name>{escape(project)}</Name></Project></ProjectInfo>',
        )
        _add(file, "extensions.xml", _extensions())
        for number, topic in enumerate(topics):
            folder = _uuid(project + topic.key)
            view = _uuid(project + topic.key + "view")
            _add(file, f"{folder}/markup.bcf", _markup(topic, folder, view, number, date))
            _add(file, f"{folder}/{view}.bcfv", _viewpoint(topic, view))
            file.writestr(zipfile.ZipInfo(f"{folder}/{view}.png", DATE), topic.snapshot)


def _add(file: zipfile.ZipFile, name: str, text: str) -> None:
    info = zipfile.ZipInfo(name, DATE)
    info.compress_type = zipfile.ZIP_DEFLATED
    file.writestr(info, f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n')


def _uuid(key: str) -> str:
    return str(uuid.uuid5(uuid.NAMESPACE_URL, f"scan2bim:{key}"))


def _extensions() -> str:
    labels = "".join(f"<TopicLabel>{label}</TopicLabel>" for label in LABELS)
    return (
        f"<Extensions><TopicTypes><TopicType>{TYPE}</TopicType></TopicTypes>"
        "<TopicStatuses><TopicStatus>Open</TopicStatus><TopicStatus>Closed</TopicStatus></TopicStatuses>"
        f"<Priorities><Priority>Major</Priority><Priority>Minor</Priority></Priorities>"
        f"<TopicLabels>{labels}</TopicLabels><Users><User>{AUTHOR}</User></Users><SnippetTypes/><Stages/></Extensions>"
    )


def _markup(topic: Topic, guid: str, view: str, number: int, date: str) -> str:
    return (
        f'<Markup><Topic Guid="{guid}" TopicType="{TYPE}" TopicStatus="Open">'
        f"<Title>{escape(topic.title)}</Title><Priority>Major</Priority><Index>{number}</Index>"
        f"<Labels><Label>{escape(topic.label)}</Label></Labels>"
        f"<CreationDate>{date}</CreationDate><CreationAuthor>{AUTHOR}</CreationAuthor>"
        f"<Description>{escape(topic.description)}</Description>"
        f'<Viewpoints><ViewPoint Guid="{view}"><Viewpoint>{view}.bcfv</Viewpoint><Snapshot>{view}.png</Snapshot>'
        "</ViewPoint></Viewpoints>"
        "</Topic></Markup>"
    )


def _viewpoint(topic: Topic, guid: str) -> str:
    middle = topic.box.mean(axis=0)
    away = max(float(np.linalg.norm(topic.box[1] - topic.box[0])) / 2 * DISTANCE, 2.0)
    towards = np.array([0.5, 0.6, -0.62])
    towards /= np.linalg.norm(towards)
    right = np.cross(towards, [0.0, 0.0, 1.0])
    up = np.cross(right / math.hypot(*right), towards)
    # No colours: version 3.0 holds them otherwise than 2.1 did, and readers stumble; what is selected shows.
    chosen = "".join(f"<Component IfcGuid={quoteattr(g)}/>" for g in topic.guids)
    selection = f"<Selection>{chosen}</Selection>" if chosen else ""
    return (
        f'<VisualizationInfo Guid="{guid}"><Components>{selection}<Visibility DefaultVisibility="true"/>'
        f"</Components><PerspectiveCamera>{_point('CameraViewPoint', middle - away * towards)}"
        f"{_point('CameraDirection', towards)}{_point('CameraUpVector', up)}"
        "<FieldOfView>60</FieldOfView><AspectRatio>1.333</AspectRatio></PerspectiveCamera></VisualizationInfo>"
    )


def _point(name: str, values: F64) -> str:
    x, y, z = (f"{float(value):.6f}" for value in values)
    return f"<{name}><X>{x}</X><Y>{y}</Y><Z>{z}</Z></{name}>"
