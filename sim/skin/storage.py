"""Rest pose and skin in a trajectory file (HDF5), in SI units: groups `rest` and `human_skin`.

`docs/methods/simulate.md` lists what they hold.
"""

from __future__ import annotations

import h5py
import numpy as np

from sim.model.anatomy import Subject
from sim.skin.binding import Weights
from sim.skin.bound import BoundSkin
from sim.skin.frame import RestPose

PACKED = {"compression": "gzip", "shuffle": True}


def _put(group: h5py.Group, name: str, values: object, unit: str) -> None:
    array = np.asarray(values)
    data = group.create_dataset(name, data=array, **(PACKED if array.ndim > 1 else {}))
    data.attrs["unit"] = unit


def put_rest(file: h5py.File, rest: RestPose) -> None:
    """Write a rest pose."""
    group, subject = file.create_group("rest"), rest.subject
    group.attrs.update(sex=subject.sex, stature_m=subject.stature, mass_kg=subject.mass)
    group.create_dataset("bodies", data=list(rest.bodies), dtype=h5py.string_dtype())
    _put(group, "position", rest.position, "m")
    _put(group, "quaternion", rest.quaternion, "1")
    _put(group, "abdomen", rest.abdomen, "m")
    _put(group, "wall", rest.wall, "1")
    for name, at in rest.marks.items():
        _put(group, f"marks/{name}", at, "m")


def take_rest(file: h5py.File) -> RestPose:
    """Read a rest pose."""
    group = file["rest"]
    told = group.attrs
    return RestPose(
        subject=Subject(
            sex=str(told["sex"]), stature=float(told["stature_m"]), mass=float(told["mass_kg"])
        ),
        bodies=tuple(group["bodies"].asstr()[:].tolist()),
        position=group["position"][:],
        quaternion=group["quaternion"][:],
        abdomen=group["abdomen"][:],
        wall=np.asarray(group["wall"][:], dtype=np.int64),
        marks={name: data[:] for name, data in group["marks"].items()},
    )


def put_skin(file: h5py.File, skin: BoundSkin) -> None:
    """Write a skin; its handles are the bodies, then the vertices of the abdomen."""
    group = file.create_group("human_skin")
    group.attrs.update(skin.about)
    group.attrs["handles"] = f"{len(skin.rest.bodies)} bodies, then vertices of soft/abdomen"
    _put(group, "vertices", skin.vertices.astype(np.float32), "m")
    _put(group, "faces", skin.faces.astype(np.int32), "1")
    _put(group, "handle", skin.weights.handle.astype(np.int16), "1")
    _put(group, "weight", skin.weights.weight.astype(np.float32), "1")


def take_skin(file: h5py.File, rest: RestPose) -> BoundSkin:
    """Read a skin."""
    group = file["human_skin"]
    weight = np.asarray(group["weight"][:], dtype=float)
    about = {k: v if isinstance(v, str) else float(v) for k, v in group.attrs.items()}
    about.pop("handles", None)
    return BoundSkin(
        vertices=np.asarray(group["vertices"][:], dtype=float),
        faces=np.asarray(group["faces"][:], dtype=np.int64),
        weights=Weights(
            handle=np.asarray(group["handle"][:], dtype=np.int64),
            weight=weight / weight.sum(axis=1, keepdims=True),
        ),
        rest=rest,
        about=about,
    )
