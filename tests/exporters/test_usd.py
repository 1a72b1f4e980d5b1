"""USD files hold the building: valid, closed, placed, named, hinged and the same on every run."""

from __future__ import annotations

import math
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import pytest
from buildings import building, door, special_storey, turned, wall
from every_shape import every_shape
from pxr import Gf, Tf, Usd, UsdGeom, UsdPhysics, UsdSemantics, UsdShade, UsdUtils, UsdValidation

from scan2bim.errors import Scan2BimError
from scan2bim.exporters.usd import export
from scan2bim.exporters.usd_assets import STATE
from scan2bim.geometry.meshes import Mesh, is_closed, mesh_volume
from scan2bim.model.elements import Building, Storey, Wall
from scan2bim.model.ids import ifc_guid
from scan2bim.model.queries import openings_of
from scan2bim.model.shapes import LEAF_GAP, wall_angle

SUFFIXES = ("usda", "usdc", "usdz")


@pytest.fixture(scope="module", params=SUFFIXES)
def path(request, tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("usd") / f"house [1] #2.{request.param}"
    export(building(), path)
    return path


def build_stage(model: Building) -> tuple[Usd.Stage, tuple[str, ...]]:
    """The composed stage of a written ``.usdc`` and the exporter's notes; the files stay until the interpreter ends."""
    folder = Path(tempfile.mkdtemp(dir=_SCRATCH.name))
    notes = export(model, folder / "house.usdc")
    return Usd.Stage.Open(str(folder / "house.usdc")), notes


_SCRATCH = tempfile.TemporaryDirectory()


@pytest.fixture(scope="module")
def stage() -> Usd.Stage:
    return build_stage(building())[0]


def prim_of(stage: Usd.Stage, identifier: str) -> Usd.Prim:
    (prim,) = (p for p in stage.Traverse() if p.GetAttribute("ifc:GlobalId").Get() == ifc_guid(identifier))
    return prim


def read_mesh(prim: Usd.Prim) -> Mesh:
    mesh = UsdGeom.Mesh(prim)
    assert set(mesh.GetFaceVertexCountsAttr().Get()) == {3}
    indices = np.array(mesh.GetFaceVertexIndicesAttr().Get(), np.int64).reshape(-1, 3)
    return Mesh(np.array(mesh.GetPointsAttr().Get(), np.float64), indices)


def world_points(prim: Usd.Prim) -> np.ndarray:
    matrix = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default())
    return np.array([matrix.Transform(Gf.Vec3d(*point)) for point in read_mesh(prim).vertices.tolist()])


def with_walls(*walls: Wall) -> Building:
    storey = building().storeys[0].model_copy(update={"walls": walls, "spaces": (), "stairs": ()})
    return building().model_copy(update={"storeys": (storey,)})


def test_every_form_passes_all_validators_of_usd(path):
    registry = UsdValidation.ValidationRegistry()
    context = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators())
    errors = [error.GetErrorAsString() for error in context.Validate(Usd.Stage.Open(export_copy(path)))]
    assert errors == []


def export_copy(path: Path) -> str:
    """The file under a name without brackets, which USD reads as packages."""
    plain = path.with_name(f"plain{path.suffix}")
    plain.write_bytes(path.read_bytes())
    return str(plain)


def test_every_form_holds_the_same_prims_but_browsers_get_no_guides(path, stage):
    opened = Usd.Stage.Open(export_copy(path))
    prims = [list(Usd.PrimRange.Stage(s, Usd.TraverseInstanceProxies())) for s in (opened, stage)]
    if path.suffix == ".usdz":
        prims[1] = [p for p in prims[1] if UsdGeom.Imageable(p).ComputePurpose() != UsdGeom.Tokens.guide]
    assert {p.GetPath() for p in prims[0]} == {p.GetPath() for p in prims[1]}


def test_a_rerun_writes_the_same_bytes(path, tmp_path):
    again = tmp_path / path.name
    export(building(), again)
    assert again.read_bytes() == path.read_bytes()
    files = [file for file in tmp_path.rglob("*") if file.is_file()]
    assert len(files) == (1 if path.suffix == ".usdz" else 1 + 2 + 2 * 7)
    assert all((path.parent / file.relative_to(tmp_path)).read_bytes() == file.read_bytes() for file in files)


def test_a_usdz_is_one_aligned_layer_without_the_time_of_day(tmp_path):
    path = tmp_path / "house.usdz"
    export(building(), path)
    with zipfile.ZipFile(path) as package:
        (entry,) = package.infolist()
        assert package.testzip() is None
    assert (entry.filename, entry.compress_type, entry.date_time) == ("building.usdc", 0, (1980, 1, 1, 0, 0, 0))
    local = path.read_bytes()[:30]
    assert (30 + int.from_bytes(local[26:28], "little") + int.from_bytes(local[28:30], "little")) % 64 == 0
    assert UsdUtils.UsdzAssetIterator is not None


def test_the_stage_is_in_metres_with_z_up_and_a_default_prim(stage):
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert stage.GetDefaultPrim().GetPath() == "/Building"
    assert stage.GetDefaultPrim().GetDisplayName() == "Test house"
    assert stage.GetDefaultPrim().GetAttribute("s2b:frame:shift").Get() == (500_000.0, 5_400_000.0, 300.0)


def test_kinds_run_from_assembly_by_group_to_component(stage):
    kinds = {p.GetPath(): Usd.ModelAPI(p).GetKind() for p in stage.Traverse() if Usd.ModelAPI(p).GetKind()}
    for path, kind in kinds.items():
        above = kinds.get(path.GetParentPath())
        assert above in {"assembly": (None,), "group": ("assembly", "group"), "component": ("group",)}.get(
            kind, ("component",)
        )


def test_every_element_is_there_with_its_identity_and_evidence(stage):
    for storey in building().storeys:
        for element in (
            *storey.walls,
            *storey.spaces,
            *storey.slabs,
            *storey.coverings,
            *storey.columns,
            *storey.stairs,
        ):
            prim = prim_of(stage, element.id)
            assert prim.GetDisplayName() == element.name
            assert prim.GetAttribute("ifc:class").Get() == f"Ifc{type(element).__name__}"
            assert prim.GetAttribute("s2b:confidence").Get() == element.confidence
    wall_prim = prim_of(stage, "wall-g-middle")
    assert wall_prim.GetAttribute("s2b:evidence:sentence").Get() == "Both faces seen."
    assert wall_prim.GetAttribute("s2b:thickness:source").Get() == "measured"


def test_what_was_seen_of_each_face_is_an_attribute():
    model = every_shape()
    wall = next(wall for wall in model.storeys[0].walls if wall.evidence.faces)
    stage, _ = build_stage(model)
    prim = prim_of(stage, wall.id)
    for view in wall.evidence.faces:
        for share in ("seen", "occluded", "unseen"):
            assert prim.GetAttribute(f"s2b:evidence:faces:{view.side}:{share}").Get() == getattr(view, share)
    assert prim.GetAttribute("s2b:evidence:faces:left:area").Get() == 12.5


def test_every_opening_names_its_host(stage):
    for hosted in openings_of(building()):
        thing = hosted.opening.fill or hosted.opening
        assert prim_of(stage, thing.id).GetRelationship("s2b:host").GetTargets() == [
            prim_of(stage, hosted.wall.id).GetPath()
        ]


def test_every_mesh_is_closed_wound_outwards_and_bounded(stage):
    meshes = [p for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)]
    assert len(meshes) > 30
    for prim in meshes:
        mesh = read_mesh(prim)
        assert is_closed(mesh), prim.GetPath()
        assert mesh_volume(mesh) > 0, prim.GetPath()
        extent = np.array(UsdGeom.Mesh(prim).GetExtentAttr().Get())
        assert np.allclose(extent, [mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)])
        normals = np.array(UsdGeom.Mesh(prim).GetNormalsAttr().Get())
        assert np.allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-5)


def test_wall_bodies_lack_their_openings_and_meet_without_overlap(stage):
    storey = building().storeys[0]
    volume = {w.id: mesh_volume(read_mesh(prim_of(stage, w.id).GetChild("body"))) for w in storey.walls}
    middle = next(w for w in storey.walls if w.id == "wall-g-middle")
    cut = sum(o.width.value * o.height.value for o in middle.openings)
    assert volume["wall-g-middle"] == pytest.approx((7.7 * 2.6 - cut) * 0.12, rel=1e-5)
    outer = [w for w in storey.walls if w.external]
    cut = sum(o.width.value * o.height.value for w in outer for o in w.openings)
    assert sum(volume[w.id] for w in outer) == pytest.approx((2 * (10 + 8) * 2.6 - cut) * 0.3, rel=1e-5)


def test_a_wall_stands_where_the_model_says(stage):
    wall_model = next(w for w in building().storeys[1].walls if w.id == "wall-u-south")
    points = world_points(prim_of(stage, wall_model.id).GetChild("body"))
    assert points[:, 2].min() == pytest.approx(2.8, abs=1e-6)
    along = (points[:, :2] - wall_model.start) @ [math.cos(wall_angle(wall_model)), math.sin(wall_angle(wall_model))]
    assert (along.min(), along.max()) == pytest.approx((-0.15, 10.15), abs=1e-5)


@pytest.mark.parametrize("hinge", ["start", "end"])
@pytest.mark.parametrize("swing", ["left", "right"])
def test_an_open_leaf_hangs_at_its_hinge_and_stands_on_its_side(hinge, swing):
    fill = door("x", 1.0, 0.9, state="open", angle=math.pi / 2, hinge_side=hinge, swing_side=swing)
    host = wall("x", (0, 0), (4, 0), 0.2, 0.0, openings=(fill,))
    stage, notes = build_stage(with_walls(host))
    assert not [note for note in notes if "leaf" in note]
    angle = -wall_angle(host)
    points = world_points(prim_of(stage, "door-x").GetChild("leaf").GetChild("panel"))
    x = points[:, 0] * math.cos(angle) - points[:, 1] * math.sin(angle)
    y = points[:, 0] * math.sin(angle) + points[:, 1] * math.cos(angle)
    side = 1 if swing == "left" else -1
    assert ((y * side).min(), (y * side).max()) == pytest.approx((0.1, 1.0 - 2 * LEAF_GAP), abs=1e-5)
    jamb = 1.0 + LEAF_GAP if hinge == "start" else 1.9 - LEAF_GAP
    assert np.abs(x - jamb).max() == pytest.approx(0.04, abs=1e-5)
    assert np.abs(x - jamb).min() == pytest.approx(0.0, abs=1e-5)


def test_a_joint_turns_the_leaf_about_its_hinge_within_the_angle_found(stage):
    joints = [p for p in stage.Traverse() if p.IsA(UsdPhysics.RevoluteJoint)]
    assert len(joints) == 1 + 1 + 2 + 3
    for prim in joints:
        joint = UsdPhysics.RevoluteJoint(prim)
        frame, leaf = (stage.GetPrimAtPath(rel.GetTargets()[0]) for rel in (joint.GetBody0Rel(), joint.GetBody1Rel()))
        assert UsdPhysics.MassAPI(leaf).GetMassAttr().Get() == pytest.approx(24, abs=8)
        fixed = UsdPhysics.FixedJoint(frame.GetParent().GetChild("fixed"))
        assert fixed.GetBody1Rel().GetTargets() == [frame.GetPath()]
        assert not stage.GetPrimAtPath(fixed.GetBody0Rel().GetTargets()[0]).HasAPI(UsdPhysics.RigidBodyAPI)
        pivots = []
        for body, local in ((frame, joint.GetLocalPos0Attr()), (leaf, joint.GetLocalPos1Attr())):
            matrix = UsdGeom.Xformable(body).ComputeLocalToWorldTransform(Usd.TimeCode.Default())
            pivots.append(matrix.Transform(Gf.Vec3d(local.Get())))
        assert (pivots[0] - pivots[1]).GetLength() < 1e-6
        turned = leaf.GetAttribute("xformOp:rotateZ").Get() or 0.0
        assert joint.GetLowerLimitAttr().Get() - 1e-4 <= turned <= joint.GetUpperLimitAttr().Get() + 1e-4


def test_a_double_door_has_two_leaves_that_do_not_meet(stage):
    prim = prim_of(stage, "door-g3")
    names = ["Looks", "void", "leaf_1", "hinge_1", "leaf_2", "hinge_2", "frame", "fixed"]
    assert [child.GetName() for child in prim.GetChildren()] == names
    angles = [prim.GetChild(f"leaf_{k}").GetAttribute("xformOp:rotateZ").Get() for k in (1, 2)]
    assert angles == pytest.approx([math.degrees(0.5), -math.degrees(0.5)])


def test_what_is_not_known_of_a_door_is_not_drawn_but_said():
    stage, notes = build_stage(building())
    assert [c.GetName() for c in prim_of(stage, "door-g5").GetChildren()] == ["void"]
    assert any("Door g5" in note for note in notes)
    assert any("Stair 1" in note for note in notes)


def test_spaces_and_voids_are_guides_and_the_rest_is_not(stage):
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Gprim):
            guide = UsdGeom.Imageable(prim).ComputePurpose() == "guide"
            assert guide == any(word in str(prim.GetPath()) for word in ("/Spaces/", "/Stairs/", "/void", "/collision"))


def test_every_shown_mesh_has_the_elements_colour(stage):
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh) and UsdGeom.Imageable(prim).ComputePurpose() != "guide":
            assert UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()[0]
    body = prim_of(stage, "wall-g-middle").GetChild("body")
    shader = UsdShade.MaterialBindingAPI(body).ComputeBoundMaterial()[0].ComputeSurfaceSource()[0]
    assert shader.GetInput("diffuseColor").Get() == pytest.approx((0.82, 0.79, 0.72), abs=0.005)


def test_elements_of_one_id_beginning_and_odd_ids_get_prims_of_their_own():
    walls = [wall(key, (0, k), (4, k), 0.1, 0.0) for k, key in enumerate(("12345678", "12345678b", "ä/ b", "ö/ b"))]
    stage, _ = build_stage(with_walls(*walls))
    assert len({prim_of(stage, w.id).GetPath() for w in walls}) == 4


def test_an_element_without_extent_is_named_and_not_drawn():
    flat = wall("flat", (0, 0), (0, 0), 0.1, 0.0)
    stage, notes = build_stage(with_walls(flat))
    assert not prim_of(stage, flat.id).GetChildren()
    assert "Wall flat: no shape, since it has no extent." in notes


def test_an_empty_building_is_a_valid_stage(tmp_path):
    empty = Building(
        id="b", name="Empty", storeys=(Storey(id="s", name="S", elevation=building().storeys[0].elevation),)
    )
    export(empty, tmp_path / "empty.usdc")
    assert Usd.Stage.Open(str(tmp_path / "empty.usdc")).GetDefaultPrim()


def test_a_file_that_cannot_be_written_is_an_error_and_leaves_nothing(tmp_path):
    with pytest.raises((Scan2BimError, OSError, Tf.ErrorException)):
        export(building(), tmp_path / "missing" / "x.usdc")
    assert list(tmp_path.iterdir()) == []


def angle_in(stage: Usd.Stage, door_prim: Usd.Prim, state: str) -> float:
    stage.SetEditTarget(stage.GetSessionLayer())
    door_prim.GetVariantSets().GetVariantSet(STATE).SetVariantSelection(state)
    return door_prim.GetChild("leaf").GetAttribute("xformOp:rotateZ").Get()


def test_a_door_has_a_variant_for_each_state_and_stands_as_scanned():
    stage, _ = build_stage(building())
    prim = prim_of(stage, "door-g2")
    variants = prim.GetVariantSets().GetVariantSet(STATE)
    assert sorted(variants.GetVariantNames()) == ["ajar", "as_scanned", "closed", "open"]
    assert variants.GetVariantSelection() == "as_scanned"
    angles = [angle_in(stage, prim, state) for state in ("closed", "ajar", "open", "as_scanned")]
    assert angles == pytest.approx([0, -30, -90, -math.degrees(1.4)])


def test_all_variants_pass_the_validators_of_usd():
    stage, _ = build_stage(building())
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    for state in ("closed", "ajar", "open"):
        for hosted in openings_of(building()):
            if hosted.opening.fill is not None and hosted.opening.fill.kind == "door":
                prim = prim_of(stage, hosted.opening.fill.id)
                stage.SetEditTarget(stage.GetSessionLayer())
                prim.GetVariantSets().GetVariantSet(STATE).SetVariantSelection(state)
        assert [error.GetErrorAsString() for error in context.Validate(stage)] == []


def test_a_storey_is_a_payload_whose_extent_is_known_unloaded(path):
    if path.suffix == ".usdz":
        pytest.skip("one layer")
    stage = Usd.Stage.Open(export_copy(path), Usd.Stage.LoadNone)
    storey = stage.GetDefaultPrim().GetChild("Storey_storey_0")
    assert not storey.GetAllChildren() and storey.HasAuthoredPayloads()
    low, high, *_ = UsdGeom.ModelAPI(storey).GetExtentsHint()
    assert (low[2], high[2]) == pytest.approx((-0.2, 2.62))


def test_doors_of_one_form_share_one_asset():
    hung = {"state": "open", "hinge_side": "start", "swing_side": "left"}
    fills = [door(key, 1.0, angle=angle, **hung) for key, angle in (("x", 1.0), ("y", 0.5))]
    walls = [wall(o.id, (0, k * 3), (4, k * 3), 0.2, 0.0, openings=(o,)) for k, o in enumerate(fills)]
    stage, _ = build_stage(with_walls(*walls))
    assets = {
        str(item.assetPath)
        for key in "xy"
        for spec in prim_of(stage, f"door-{key}").GetPrimStack()
        for item in spec.referenceList.prependedItems
    }
    assert len(assets) == 1


def test_a_leaf_stops_at_the_wall_beside_it():
    fill = door("x", 0.2, state="closed", hinge_side="start", swing_side="left")
    host = wall("x", (0, 0), (4, 0), 0.2, 0.0, openings=(fill,))
    beside = wall("y", (0, 0.1), (0, 3), 0.2, 0.0)
    limits = []
    for walls in ((host,), (host, beside)):
        stage, _ = build_stage(with_walls(*walls))
        limits.append(UsdPhysics.RevoluteJoint(prim_of(stage, "door-x").GetChild("hinge")).GetUpperLimitAttr().Get())
    assert limits[0] == pytest.approx(110)
    reach = 0.9 - 2 * LEAF_GAP
    assert limits[1] == pytest.approx(90 + math.degrees(math.asin((0.1 + LEAF_GAP) / reach)), abs=3)


def test_labels_name_the_class_to_cameras(stage):
    labels = UsdSemantics.LabelsAPI(prim_of(stage, "door-g2"), "class")
    assert list(labels.GetLabelsAttr().Get()) == ["door"]


def test_blocks_fill_a_wall_round_its_openings(stage):
    for host in building().storeys[0].walls:
        blocks = prim_of(stage, host.id).GetChild("collision").GetChildren()
        volume = 0.0
        for block in blocks:
            assert block.HasAPI(UsdPhysics.CollisionAPI)
            volume += math.prod(UsdGeom.Cube(block).GetXformOpOrderAttr() and block.GetAttribute("xformOp:scale").Get())
        cut = sum(o.width.value * o.height.value for o in host.openings)
        ends = math.dist(host.start, host.end)
        assert volume == pytest.approx((ends * 2.6 - cut) * host.thickness.value, rel=1e-4)


def test_every_kind_of_element_has_its_shape():
    stage, notes = build_stage(building().model_copy(update={"storeys": (special_storey(),)}))
    assert notes == ()
    volumes = {
        key: mesh_volume(read_mesh(prim_of(stage, key).GetChild("body")))
        for key in ("wall-curved", "wall-gable", "wall-leaning", "wall-niche", "beam-1", "roof-1", "stair-1")
    }
    assert volumes == pytest.approx(
        {
            "wall-curved": (math.pi * 2.5 - 1.0 * 2.1) * 0.2,
            "wall-gable": (4 * 2.0 + 4 * 2.0 / 2) * 0.2,
            "wall-leaning": 4 * 2.5 * 0.2,
            "wall-niche": 4 * 2.5 * 0.2 - 1.0 * 1.0 * 0.1,
            "beam-1": 4 * 0.2 * 0.3,
            "roof-1": 4 * math.hypot(3.0, 2.0) * 0.2,
            "stair-1": (1 + 2 + 13 * 2.5) * 2.7 / 16 * 2.0 / 15,
        },
        rel=0.003,
    )
    for key in volumes:
        assert is_closed(read_mesh(prim_of(stage, key).GetChild("body")))
    points = world_points(prim_of(stage, "wall-curved").GetChild("body"))
    centre = np.array(turned(1.0, 0.0))
    assert np.hypot(*(points[:, :2] - centre).T).min() == pytest.approx(0.9, abs=0.005)


def test_a_closed_door_of_unknown_hinge_is_away_when_open():
    shut = door("x", 1.0, state="closed")
    stage, _ = build_stage(with_walls(wall("x", (0, 0), (4, 0), 0.2, 0.0, openings=(shut,))))
    prim = prim_of(stage, "door-x")
    assert prim.GetChild("leaf").IsActive()
    stage.SetEditTarget(stage.GetSessionLayer())
    prim.GetVariantSets().GetVariantSet(STATE).SetVariantSelection("open")
    assert [child.GetName() for child in prim.GetChildren()] == ["Looks", "void"]
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    assert [error.GetErrorAsString() for error in context.Validate(stage)] == []
