"""The paper's labels of voxels: as data and as a picture."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from modelled import Modelled, modelled
from synthetic import two_rooms

from scan2bim.coverage.voxels import label_storeys
from scan2bim.errors import UsageError
from scan2bim.exporters.voxels import export
from scan2bim.model.voxels import Label, VoxelGrid
from scan2bim.report.voxel_slices import export as draw
from scan2bim.simulate.scene import Box, Placement, Scene

PLACEMENT = Placement(0.3)


def furnished() -> Scene:
    """A wardrobe of 1.6 x 0.6 x 2 m stands at the north wall of the east room."""
    (storey,) = two_rooms().storeys
    wardrobe = Box("wardrobe", (6.2, 3.8), (1.6, 0.6, 2.0))
    return replace(two_rooms(), storeys=(replace(storey, boxes=(*storey.boxes[:-6], wardrobe)),), placement=PLACEMENT)


@pytest.fixture(scope="module")
def model() -> Modelled:
    return modelled(furnished())


@pytest.fixture(scope="module")
def grid(model: Modelled) -> VoxelGrid:
    (found,) = label_storeys(model.building, model.cloud)
    return found


def at(grid: VoxelGrid, model: Modelled, x: float, y: float, z: float) -> Label:
    """The label at a place of the scene's own frame."""
    place = PLACEMENT.points(np.array([[x, y, z]]))[0] - model.shift - grid.origin
    c, s = np.cos(grid.yaw), np.sin(grid.yaw)
    along, across = place[0] * c + place[1] * s, place[1] * c - place[0] * s
    col, row, layer = (int(v // grid.size) for v in (along, across, place[2]))
    return Label(grid.labels[layer, row, col])


@pytest.mark.parametrize(
    ("place", "label"),
    [
        ((2.0, 1.0, 1.2), Label.EMPTY),
        ((6.2, 3.49, 1.0), Label.CLUTTER),
        ((6.2, 3.85, 1.0), Label.OCCLUDED_CLUTTER),
        ((6.2, 4.16, 1.0), Label.OCCLUDED_STRUCTURE),
        ((2.0, 0.14, 2.3), Label.STRUCTURE),
        ((3.0, 1.0, 0.0), Label.STRUCTURE),
        ((6.2, 0.05, 1.5), Label.OPENING),
        ((4.2, 1.9, 1.5), Label.OPENING),
        ((-0.6, -0.6, 1.0), Label.NONE),
    ],
    ids=lambda value: value.words if isinstance(value, Label) else "",
)
def test_voxels_are_labelled_as_the_paper_does(
    grid: VoxelGrid, model: Modelled, place: tuple[float, float, float], label: Label
) -> None:
    assert at(grid, model, *place) == label


def test_most_of_the_rooms_air_is_empty_and_of_their_walls_structure(grid: VoxelGrid) -> None:
    counts = np.bincount(grid.labels.ravel(), minlength=len(Label))
    assert counts[Label.EMPTY] > 10 * counts[Label.OCCLUDED_CLUTTER] > 0
    assert counts[Label.STRUCTURE] > 4 * counts[Label.OCCLUDED_STRUCTURE] > 0


def test_the_archive_holds_the_labels_and_where_they_are(grid: VoxelGrid, model: Modelled, tmp_path: Path) -> None:
    path = tmp_path / "flat.voxels.npz"
    assert export(model.building, path, lambda building: label_storeys(building, model.cloud)) == ()
    with np.load(path) as archive:
        assert archive["version"] == 1
        assert list(archive["label_names"]) == [label.words for label in Label]
        assert np.array_equal(archive["storey_0/labels"], grid.labels)
        assert archive["storey_0/origin"] == pytest.approx(grid.origin + model.shift)
        assert (float(archive["storey_0/size"]), float(archive["storey_0/yaw"])) == (grid.size, grid.yaw)


def test_the_picture_shows_a_slice_in_the_labels_colours(grid: VoxelGrid, model: Modelled, tmp_path: Path) -> None:
    path = tmp_path / "flat.voxels.png"
    draw(model.building, path, lambda building: iter([grid]))
    image = cv2.imread(str(path))
    assert image is not None and image.shape[1] > 600
    empty = (image == (248, 234, 214)).all(2).mean()
    assert empty > 0.1


@pytest.mark.parametrize("write", [export, draw])
def test_without_scans_it_is_said_that_they_are_needed(write: object, model: Modelled, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="need the scans"):
        write(model.building, tmp_path / "flat.voxels.npz", None)  # type: ignore[operator]
