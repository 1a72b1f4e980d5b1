"""What still stands where it stood keeps its identifier from an earlier model; what is new has one of its own."""

from __future__ import annotations

from typing import Any

import pytest
from buildings import building
from every_shape import every_shape

from scan2bim.model.elements import Building, Opening, Wall
from scan2bim.model.kept_ids import with_ids_of
from scan2bim.model.queries import everything


def anew(model: Building) -> Building:
    """The same building under other ids, as another survey would name it."""
    ids = {thing.id for thing in everything(model)}

    def renamed(value: Any) -> Any:
        if isinstance(value, dict):
            return {key: renamed(part) for key, part in value.items()}
        if isinstance(value, tuple):
            return tuple(renamed(part) for part in value)
        return f"again {value}" if isinstance(value, str) and value in ids else value

    return Building.model_validate(renamed(model.model_dump()))


def ids_of(model: Building) -> list[str]:
    return [thing.id for thing in everything(model) if thing not in model.scans]


def moved(wall: Wall, x: float, y: float) -> Wall:
    (x0, y0), (x1, y1) = wall.start, wall.end
    return wall.model_copy(update={"start": (x0 + x, y0 + y), "end": (x1 + x, y1 + y)})


def with_wall(model: Building, old: Wall, new: Wall) -> Building:
    storeys = tuple(
        storey.model_copy(update={"walls": tuple(new if wall == old else wall for wall in storey.walls)})
        for storey in model.storeys
    )
    return model.model_copy(update={"storeys": storeys})


@pytest.mark.parametrize("model", [building(), every_shape()], ids=["house", "every shape"])
def test_a_building_that_did_not_change_keeps_every_id_and_reference(model: Building):
    survey = anew(model)
    assert not set(ids_of(survey)) & set(ids_of(model))
    found = with_ids_of(survey, model)
    assert ids_of(found) == ids_of(model)
    assert [w.joins for s in found.storeys for w in s.walls] == [w.joins for s in model.storeys for w in s.walls]
    assert [w.left_spaces for s in found.storeys for w in s.walls] == [
        w.left_spaces for s in model.storeys for w in s.walls
    ]


def test_a_shifted_origin_and_noise_change_no_id():
    model = building()
    frame = model.frame.model_copy(update={"shift": tuple(part + 100.0 for part in model.frame.shift)})
    survey = anew(model)
    for storey in survey.storeys:
        for wall in storey.walls:
            survey = with_wall(survey, wall, moved(wall, 0.004, -0.003))
    assert ids_of(with_ids_of(survey, model)) == ids_of(model)
    far = with_ids_of(survey.model_copy(update={"frame": frame}), model)
    assert not set(ids_of(far)) & set(ids_of(model)) - {model.id}


def test_a_thin_wall_that_was_moved_by_its_thickness_is_the_same_and_one_elsewhere_is_new():
    model = building()
    thin = next(wall for wall in model.storeys[0].walls if wall.thickness.value == 0.12)
    survey = anew(model)
    twin = next(wall for wall in survey.storeys[0].walls if wall.id == f"again {thin.id}")
    near = with_ids_of(with_wall(survey, twin, moved(twin, 0.08, 0.08)), model)
    assert thin.id in ids_of(near)
    far = with_ids_of(with_wall(survey, twin, moved(twin, 1.5, 1.5)), model)
    assert thin.id not in ids_of(far)
    assert twin.id in ids_of(far)


def test_an_opening_that_is_now_a_window_keeps_its_own_id_and_gets_a_new_fill():
    model = building()
    window = next(
        o.fill for s in model.storeys for w in s.walls for o in w.openings if o.fill and o.fill.kind == "window"
    )
    wall = next(w for w in model.storeys[0].walls if any(o.fill and o.fill.kind == "door" for o in w.openings))
    (door, *others) = wall.openings

    def swapped(opening: Opening, fill: object) -> Wall:
        return wall.model_copy(update={"openings": (opening.model_copy(update={"fill": fill}), *others)})

    survey = with_wall(model, wall, swapped(door, window.model_copy(update={"id": "glazed"}) if window else None))
    found = ids_of(with_ids_of(survey, model))
    assert door.id in found and "glazed" in found
    assert door.fill is not None and door.fill.id not in found


def test_an_id_that_was_given_away_is_not_used_twice():
    model = building()
    first, second, *_ = model.storeys[0].walls
    swapped = with_wall(
        with_wall(model, first, moved(first, 50.0, 0.0)),
        second,
        first.model_copy(update={"id": second.id, "openings": ()}),
    )
    found = ids_of(with_ids_of(swapped, model))
    assert len(found) == len(set(found))
    assert found.count(first.id) == 1
