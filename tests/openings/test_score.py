"""The probability of a closed door from what a face shows of it."""

from __future__ import annotations

from dataclasses import replace

from scan2bim.openings.closed.evidence import FaceEvidence
from scan2bim.openings.closed.find import ACCEPTED
from scan2bim.openings.closed.rectangles import Rectangle
from scan2bim.openings.closed.score import confidence, features_of, probability

DOOR = Rectangle(0.8, 1.9, 2.1)
FLUSH = FaceEvidence(
    left=0.94,
    right=0.94,
    head=0.94,
    agree=0.94,
    shown=0.95,
    seen=0.95,
    recess=0.0,
    colour=0.037,
    trim=0.0,
    beyond=0.0,
    foot=1.0,
    handle=None,
    handle_side=None,
    through=0.0,
    dominant=0.99,
    whole=1.0,
    lintel=0.99,
    flank=0.98,
    onward=0.25,
    loose=False,
)
"""A leaf in the wall's plane, of nearly its colour, seen from one side: its outline alone tells of it."""


def said(evidence: FaceEvidence, box: Rectangle = DOOR) -> float:
    return confidence(probability(features_of([evidence], box)))


def test_a_complete_outline_is_a_door_though_its_leaf_is_flush_and_of_the_walls_colour() -> None:
    assert said(FLUSH) > ACCEPTED


def test_an_outline_that_goes_on_above_its_head_is_none() -> None:
    assert said(replace(FLUSH, beyond=1.0)) < ACCEPTED


def test_an_outline_that_is_missing_on_one_side_is_none() -> None:
    assert said(replace(FLUSH, left=0.4)) < ACCEPTED
