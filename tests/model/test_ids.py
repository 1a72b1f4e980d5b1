from __future__ import annotations

import uuid

import ifcopenshell.guid
import numpy as np
import pytest

from scan2bim.model.ids import distinct, ifc_guid, stable_id


def test_the_same_key_gives_the_same_id_on_every_machine():
    assert stable_id("wall", 0, (1.0, 2.0), (3.0, 4.0)) == "b39d684a-4205-517a-acae-86ea9f565ecf"
    assert ifc_guid("wall-1") == "0gq7VRBSPTkf1KcEibMxmc"


def test_noise_below_the_grid_does_not_change_an_id():
    assert stable_id("wall", 0, (1.001, 2.0)) == stable_id("wall", 0, (0.999, 2.004))


def test_numpy_and_python_numbers_give_the_same_id():
    assert stable_id("wall", np.int64(1), np.array([1.0, 2.0], np.float32)) == stable_id("wall", 1, (1.0, 2.0))


@pytest.mark.parametrize(
    "other",
    [("slab", 0, 1.0), ("wall", 1, 1.0), ("wall", 0, 1.3), ("wall", 0, (1.0,)), ("wall", 0.0, 1.0), ("wall", 0, "1")],
)
def test_another_kind_storey_place_or_shape_of_key_gives_another_id(other: tuple[str, *tuple[object, ...]]):
    assert stable_id("wall", 0, 1.0) != stable_id(*other)


def test_a_key_of_anything_else_is_refused():
    with pytest.raises(TypeError, match="text, numbers and sequences"):
        stable_id("wall", None)


def test_repeated_ids_become_distinct_and_stay_so():
    once = distinct(["a", "b", "a", "a"])
    assert once == distinct(["a", "b", "a", "a"])
    assert once[:2] == ("a", "b")
    assert len(set(once)) == 4


def test_an_ifc_guid_is_the_compressed_uuid():
    for n in range(50):
        name = stable_id("thing", n)
        assert ifc_guid(name) == ifcopenshell.guid.compress(uuid.UUID(name).hex)


def test_any_text_has_an_ifc_guid_that_expands_to_a_uuid():
    for text in ("wall-1", "", "Küche", "67A9A2A1-0B4C-5B0C-9E5C-0F5A6D3B6D7E"):
        assert len(ifc_guid(text)) == 22
        uuid.UUID(ifcopenshell.guid.expand(ifc_guid(text)))
    assert ifc_guid("a") != ifc_guid("b")
