"""USD: bodies as moving transforms, soft surfaces as moving points, muscles as curves.

Metres, Z up, X forward, as in the trajectory: a USD file states its axes, so nothing is turned. One
time code is one frame.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.look import MARKER, SEE_THROUGH, SIMULATED, fibre_width, levels, linear, ramp
from pipeline.scene import layers
from sim.motion import Elements, Motion

Floats = NDArray[np.float64]
ROUGHNESS = 0.7


class _Writer:
    """A stage that is filled; the library is imported when somebody asks for a file."""

    def __init__(self, motion: Motion, about: dict[str, Any], rate: float) -> None:
        from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdShade, Vt

        self.Gf, self.Sdf, self.Tf, self.Vt = Gf, Sdf, Tf, Vt
        self.Geom, self.Shade = UsdGeom, UsdShade
        self.motion = motion
        self.stage = Usd.Stage.CreateInMemory()
        UsdGeom.SetStageUpAxis(self.stage, UsdGeom.Tokens.z)
        UsdGeom.SetStageMetersPerUnit(self.stage, 1.0)
        self.stage.SetTimeCodesPerSecond(rate)
        self.stage.SetFramesPerSecond(rate)
        self.stage.SetStartTimeCode(0.0)
        self.stage.SetEndTimeCode(len(motion.time) - 1.0)
        root = UsdGeom.Xform.Define(self.stage, "/torso").GetPrim()
        self.stage.SetDefaultPrim(root)
        Usd.ModelAPI(root).SetKind("component")
        root.SetCustomData({key: str(value) for key, value in about.items()})
        self.materials = {row["layer"]: self.material(row) for row in layers()}

    def path(self, above: str, name: str) -> str:
        """A place for a thing; names that USD forbids are mended, and told apart."""
        word = self.Tf.MakeValidIdentifier(name)
        path, k = f"{above}/{word}", 2
        while self.stage.GetPrimAtPath(path):
            path, k = f"{above}/{word}_{k}", k + 1
        return path

    def named(self, thing: Any, name: str) -> Any:
        """Keep a name that was mended."""
        thing.GetPrim().SetDisplayName(name)
        return thing

    def material(self, row: dict[str, Any]) -> Any:
        """Look of a layer."""
        path = self.path("/torso/materials", row["layer"])
        made = self.Shade.Material.Define(self.stage, path)
        shader = self.Shade.Shader.Define(self.stage, f"{path}/surface")
        shader.CreateIdAttr("UsdPreviewSurface")
        kinds, alpha = self.Sdf.ValueTypeNames, SEE_THROUGH.get(row["layer"], 1.0)
        shader.CreateInput("diffuseColor", kinds.Color3f).Set(self.Gf.Vec3f(*linear(row["colour"])))
        shader.CreateInput("roughness", kinds.Float).Set(ROUGHNESS)
        shader.CreateInput("opacity", kinds.Float).Set(alpha)
        made.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
        return made

    def vectors(self, values: Floats) -> Any:
        """Rows of three as USD keeps them."""
        return self.Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values, dtype=np.float32))

    def put_points(self, thing: Any, points: Floats, code: float | None = None) -> None:
        """Set points and the box about them, once or at a time code."""
        box = self.vectors(np.stack([points.min(axis=0), points.max(axis=0)]))
        at = () if code is None else (code,)
        thing.GetPointsAttr().Set(self.vectors(points), *at)
        thing.GetExtentAttr().Set(box, *at)

    def mesh(self, above: str, name: str, faces: Any, layer: str) -> Any:
        """Add a surface of triangles; its points come after."""
        made = self.named(self.Geom.Mesh.Define(self.stage, self.path(above, name)), name)
        counts = np.full(len(faces), 3, dtype=np.int32)
        made.GetFaceVertexCountsAttr().Set(self.Vt.IntArray.FromNumpy(counts))
        order = np.ascontiguousarray(np.ravel(faces), dtype=np.int32)
        made.GetFaceVertexIndicesAttr().Set(self.Vt.IntArray.FromNumpy(order))
        made.GetSubdivisionSchemeAttr().Set(self.Geom.Tokens.none)
        made.GetDoubleSidedAttr().Set(True)
        if layer in self.materials:
            self.Shade.MaterialBindingAPI.Apply(made.GetPrim()).Bind(self.materials[layer])
        return made

    def bodies(self) -> None:
        """Add each body as a moving transform with what it carries."""
        motion, Gf = self.motion, self.Gf
        for b, body in enumerate(motion.bodies):
            path = self.path("/torso/bodies", body)
            made = self.named(self.Geom.Xform.Define(self.stage, path), body)
            # in single precision the library loses turns of less than a milliradian
            turn_precision = self.Geom.XformOp.PrecisionDouble
            place, turn = made.AddTranslateOp(), made.AddOrientOp(turn_precision)
            for frame in range(len(motion.time)):
                place.Set(Gf.Vec3d(*motion.position[frame, b].tolist()), frame)
                turn.Set(Gf.Quatd(*motion.quaternion[frame, b].tolist()), frame)
            for name, shape in motion.shapes.items():
                if shape.body == body:
                    mesh = self.mesh(path, name, shape.faces, str(shape.tissue))
                    self.put_points(mesh, shape.vertices)

    def surfaces(self) -> None:
        """Add each soft surface, exact in every frame."""
        for name, soft in self.motion.soft.items():
            mesh = self.mesh("/torso/soft", name, soft.faces, name)
            for frame, points in enumerate(soft.vertices):
                self.put_points(mesh, points, frame)

    def muscles(self, elements: Elements) -> None:
        """Add each group's elements as straight curves: width and colour by tension."""
        level = levels(elements.tension, float(elements.tension.max(initial=0.0)))
        groups = np.array(elements.group)
        for group in sorted(set(elements.group)):
            part = np.flatnonzero(groups == group)
            path = self.path("/torso/muscles", group)
            made = self.named(self.Geom.BasisCurves.Define(self.stage, path), group)
            made.GetTypeAttr().Set(self.Geom.Tokens.linear)
            counts = np.full(len(part), 2, dtype=np.int32)
            made.GetCurveVertexCountsAttr().Set(self.Vt.IntArray.FromNumpy(counts))
            made.SetWidthsInterpolation(self.Geom.Tokens.uniform)
            colour = made.CreateDisplayColorPrimvar(self.Geom.Tokens.uniform)
            for frame in range(len(self.motion.time)):
                self.put_points(made, elements.endpoints[frame, part].reshape(-1, 3), frame)
                width = fibre_width(level[frame, part]).astype(np.float32)
                made.GetWidthsAttr().Set(self.Vt.FloatArray.FromNumpy(width), frame)
                colour.Set(self.vectors(ramp(level[frame, part])), frame)

    def markers(self) -> None:
        """Add each marker as a small moving ball."""
        for m, name in enumerate(self.motion.marker_names):
            path = self.path("/torso/markers", name)
            made = self.named(self.Geom.Sphere.Define(self.stage, path), name)
            made.GetRadiusAttr().Set(MARKER)
            made.GetExtentAttr().Set(self.vectors(MARKER * np.array([[-1.0] * 3, [1.0] * 3])))
            made.GetDisplayColorAttr().Set(self.vectors(np.array([linear(SIMULATED)])))
            place = made.AddTranslateOp()
            for frame, at in enumerate(self.motion.markers[:, m].tolist()):
                place.Set(self.Gf.Vec3d(*at), frame)


def write_usd(motion: Motion, about: dict[str, Any], rate: float, path: Path) -> None:
    """Write a trajectory as USD; the ending says whether as text (`.usda`) or as numbers.

    Parameters
    ----------
    about : written into the file
    rate : Hz, of the frames
    """
    out = _Writer(motion, about, rate)
    out.bodies()
    out.surfaces()
    if motion.elements is not None:
        out.muscles(motion.elements)
    out.markers()
    out.stage.GetRootLayer().Export(str(path))
