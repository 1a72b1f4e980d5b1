"""One room with closed doors of which more and more is hidden: the sweep from 0 to 50 % occlusion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scan2bim.simulate.clutter import Along, Sights, hang, hide
from scan2bim.simulate.scene import DoorSpec, Placement, Room, Scene, Station, StoreySpec, WallSpec
from scan2bim.simulate.variation import EYE, FLOOR_COLOURS, WALL_COLOURS, dress, one_of, spread, window

CASES = 44
MOST = 0.5
THICKNESS = 0.2


def occlusion_of(number: int) -> float:
    """The hidden share wanted of the door's wall in a case, 0 to 50 %."""
    return MOST * (number % CASES) / (CASES - 1)


def case(number: int, seed: int = 0) -> Scene:
    """Case ``number`` of the sweep: a room with a wall of two closed doors, hidden to ``occlusion_of(number)``."""
    rng = np.random.default_rng([seed, number, 44])
    length, width = float(rng.uniform(5.5, 8.0)), float(rng.uniform(4.5, 6.5))
    colour = one_of(WALL_COLOURS, rng)
    ring = [(0.0, 0.0), (length, 0.0), (length, width), (0.0, width)]
    walls = [
        WallSpec(f"wall {i + 1}", a, ring[(i + 1) % 4], THICKNESS, True, (), (), colour, colour, "paint", 0.07)
        for i, a in enumerate(ring)
    ]
    sizes = [(float(rng.uniform(0.75, 1.05)), float(rng.uniform(1.98, 2.2))) for _ in range(2)]
    doors = [DoorSpec(f"door {i + 1}", 0.0, w, h) for i, (w, h) in enumerate(sizes)]
    doors = [dress(d, colour, THICKNESS, rng, hard=rng.random() < 0.2) for d in doors]
    places = spread(walls[0], [d.width for d in doors], rng)
    walls[0] = replace(walls[0], doors=tuple(replace(d, offset=x) for d, x in zip(doors, places, strict=True)))
    pane = window("window", rng)
    walls[2] = replace(walls[2], windows=(replace(pane, offset=spread(walls[2], [pane.width], rng)[0]),))
    hung = [p for i, w in enumerate(walls) for p in hang(Along.of(w, 1.0), 1 if i == 0 else 2, rng, colour)]
    room = Room("room", (length / 2, width / 2), one_of(FLOOR_COLOURS, rng))
    height = float(rng.uniform(2.5, 2.9))
    boxes = tuple(box for piece in hung for box in piece)
    storey = StoreySpec("ground floor", tuple(walls), (room,), height=height, boxes=boxes)
    stations = tuple(
        Station(f"station_{i + 1}", (length * x, width * float(rng.uniform(0.5, 0.75)), EYE), float(rng.uniform(0, 6)))
        for i, x in enumerate((0.28, 0.72))
    )
    turned = Placement(float(rng.uniform(-0.7, 0.7)), (float(rng.uniform(-9, 9)), float(rng.uniform(-9, 9)), 0.0))
    scene = Scene(f"case {number}", (storey,), stations, turned)
    wanted = occlusion_of(number)
    return hide(scene, Sights(scene), {0: wanted}, rng, tries=200) if wanted > 0.0 else scene
