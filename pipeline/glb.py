"""Animated GLB (glTF 2.0): bones as nodes, soft surfaces as morph targets; metres, Y up.

Ours is X anterior, Y left, Z up; glTF is X left, Y up, Z forward, so every vector's components
move round by one, which is a rotation. Morph weights stay within [0, 1], since some readers clamp
them: a component's smallest weight is put into the base shape, and its target spans the range.
"""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.look import SEE_THROUGH, linear
from pipeline.packing import principal
from pipeline.scene import layers
from sim.model.landmarks import vertex_normals
from sim.motion import Motion, Soft

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

TOLERANCE = 2e-4
"""m, of soft surfaces."""
MAGIC, JSON_CHUNK, BINARY_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942
FLOAT, SHORT = 5126, 5123
VERTICES, INDICES = 34962, 34963
WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


def turned(vectors: Floats) -> Floats:
    """Vectors (..., 3) with X left, Y up, Z forward."""
    return np.asarray(vectors[..., [1, 2, 0]])


def turned_quaternions(quaternions: Floats) -> Floats:
    """Quaternions w x y z (n_frames, ..., 4) as x y z w of the turned axes, without jumps."""
    out = quaternions[..., [2, 3, 1, 0]].copy()
    away = (out[1:] * out[:-1]).sum(axis=-1) < 0
    flips = np.cumsum(away, axis=0) % 2 == 1
    out[1:][flips] *= -1
    return np.asarray(out / np.linalg.norm(out, axis=-1, keepdims=True))


class _Writer:
    """Collects the parts of a glTF file."""

    def __init__(self) -> None:
        self.binary = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []
        self.nodes: list[dict[str, Any]] = []
        self.meshes: list[dict[str, Any]] = []
        self.samplers: list[dict[str, Any]] = []
        self.channels: list[dict[str, Any]] = []
        self.materials: list[dict[str, Any]] = []
        self.material: dict[str, int] = {}

    def put(self, values: Any, kind: str, *, target: int | None = None, span: bool = False) -> int:
        """Add an accessor; `span` writes its least and greatest values."""
        whole = target == INDICES
        data = np.ascontiguousarray(values, dtype=np.uint16 if whole else np.float32)
        self.binary += bytes(-len(self.binary) % 4)
        view: dict[str, Any] = {"buffer": 0, "byteOffset": len(self.binary)}
        view["byteLength"] = data.nbytes
        if target is not None:
            view["target"] = target
        self.binary += data.tobytes()
        self.views.append(view)
        rows = data.reshape(-1, WIDTHS[kind])
        accessor: dict[str, Any] = {
            "bufferView": len(self.views) - 1,
            "componentType": SHORT if whole else FLOAT,
            "count": len(rows),
            "type": kind,
        }
        if span:
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def points(self, values: Floats) -> int:
        """Add (n, 3) turned places or moves."""
        return self.put(values, "VEC3", target=VERTICES, span=True)

    def node(self, content: dict[str, Any]) -> int:
        """Add a node."""
        self.nodes.append(content)
        return len(self.nodes) - 1

    def primitive(self, vertices: Floats, faces: Any, layer: str) -> dict[str, Any]:
        """Return a surface of turned vertices (n, 3)."""
        normals = vertex_normals(vertices, np.asarray(faces, dtype=np.int64))
        lost = np.linalg.norm(normals, axis=1) < 0.5
        normals[lost] = [0.0, 1.0, 0.0]
        normal = self.put(normals, "VEC3", target=VERTICES)
        return {
            "attributes": {"POSITION": self.points(vertices), "NORMAL": normal},
            "indices": self.put(np.ravel(faces), "SCALAR", target=INDICES),
            "material": self.material[layer],
        }

    def mesh(self, name: str, primitive: dict[str, Any], **more: Any) -> int:
        """Add a mesh of one primitive."""
        self.meshes.append({"name": name, "primitives": [primitive], **more})
        return len(self.meshes) - 1

    def animate(self, node: int, path: str, time: int, output: int) -> None:
        """Let a node follow a sampled curve."""
        self.samplers.append({"input": time, "output": output, "interpolation": "LINEAR"})
        target = {"node": node, "path": path}
        self.channels.append({"sampler": len(self.samplers) - 1, "target": target})

    def add_materials(self) -> None:
        """One material a layer, in the colours of the viewer."""
        for row in layers():
            alpha = SEE_THROUGH.get(row["layer"], 1.0)
            look: dict[str, Any] = {
                "name": row["label"],
                "doubleSided": True,
                "pbrMetallicRoughness": {
                    "baseColorFactor": [*linear(row["colour"]), alpha],
                    "metallicFactor": 0.0,
                    "roughnessFactor": 0.7,
                },
            }
            if alpha < 1.0:
                look["alphaMode"] = "BLEND"
            self.material[row["layer"]] = len(self.materials)
            self.materials.append(look)


def _add_bodies(out: _Writer, motion: Motion, time: int) -> list[int]:
    position, turn = turned(motion.position), turned_quaternions(motion.quaternion)
    roots = []
    for b, body in enumerate(motion.bodies):
        carried = {k: s for k, s in motion.shapes.items() if s.body == body}
        content: dict[str, Any] = {
            "name": body,
            "translation": position[0, b].tolist(),
            "rotation": turn[0, b].tolist(),
        }
        meshes = {
            name: out.mesh(name, out.primitive(turned(s.vertices), s.faces, str(s.tissue)))
            for name, s in carried.items()
        }
        if list(meshes) == [body]:
            content["mesh"] = meshes[body]
        elif meshes:
            children = [out.node({"name": name, "mesh": m}) for name, m in meshes.items()]
            content["children"] = children
        node = out.node(content)
        out.animate(node, "translation", time, out.put(position[:, b], "VEC3"))
        out.animate(node, "rotation", time, out.put(turn[:, b], "VEC4"))
        roots.append(node)
    return roots


def _add_surface(out: _Writer, name: str, soft: Soft, time: int) -> tuple[int, float]:
    """Add a soft surface; return its node and its error, m."""
    modes = principal(turned(soft.vertices), TOLERANCE)
    weights = modes.weights.values()
    low, high = weights.min(axis=0, initial=0.0), weights.max(axis=0, initial=0.0)
    span = np.maximum(high - low, 1e-12)
    moves = (modes.scale[:, None] * modes.shapes).reshape(len(span), -1, 3)
    base = modes.mean.values() + np.tensordot(low, moves, axes=1)
    primitive = out.primitive(base, soft.faces, name)
    unit = np.clip((weights - low) / span, 0.0, 1.0)
    more: dict[str, Any] = {}
    if len(span):
        primitive["targets"] = [
            {"POSITION": out.points(s * move)} for s, move in zip(span, moves, strict=True)
        ]
        more = {"weights": unit[0].tolist()}
    node = out.node({"name": name, "mesh": out.mesh(name, primitive, **more)})
    if len(span):
        out.animate(node, "weights", time, out.put(unit, "SCALAR"))
    return node, modes.error


def _add_markers(out: _Writer, motion: Motion, time: int) -> list[int]:
    places, nodes = turned(motion.markers), []
    for m, name in enumerate(motion.marker_names):
        node = out.node({"name": f"marker_{name}", "translation": places[0, m].tolist()})
        out.animate(node, "translation", time, out.put(places[:, m], "VEC3"))
        nodes.append(node)
    return nodes


def glb_bytes(motion: Motion, about: dict[str, Any]) -> tuple[bytes, float]:
    """A trajectory as a GLB file, and the largest error of a soft surface, m.

    Parameters
    ----------
    about : written as the file's extras
    """
    out = _Writer()
    out.add_materials()
    start = motion.time - motion.time[0]
    time = out.put(start, "SCALAR", span=True)
    roots = _add_bodies(out, motion, time)
    errors = [0.0]
    for name, soft in motion.soft.items():
        node, error = _add_surface(out, name, soft, time)
        roots.append(node)
        errors.append(error)
    roots += _add_markers(out, motion, time)
    root = out.node({"name": "torso", "children": roots})
    content = {
        "asset": {"version": "2.0", "generator": "Pleura", "extras": about},
        "scene": 0,
        "scenes": [{"nodes": [root]}],
        "nodes": out.nodes,
        "meshes": out.meshes,
        "materials": out.materials,
        "animations": [{"name": "motion", "samplers": out.samplers, "channels": out.channels}],
        "accessors": out.accessors,
        "bufferViews": out.views,
        "buffers": [{"byteLength": len(out.binary)}],
    }
    return _container(content, bytes(out.binary)), max(errors)


def _container(content: dict[str, Any], binary: bytes) -> bytes:
    text = json.dumps(content).encode("utf-8")
    text += b" " * (-len(text) % 4)
    binary += bytes(-len(binary) % 4)
    chunks = struct.pack("<II", len(text), JSON_CHUNK) + text
    chunks += struct.pack("<II", len(binary), BINARY_CHUNK) + binary
    return struct.pack("<III", MAGIC, 2, 12 + len(chunks)) + chunks
