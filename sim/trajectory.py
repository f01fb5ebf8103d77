"""The trajectory file (HDF5): the torso frame by frame, in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np

from sim.errors import InputError
from sim.model.bone_shapes import Shape
from sim.motion import Elements, Motion, Soft, dressed
from sim.physics.types import Floats
from sim.skin.storage import put_rest, put_skin, take_rest, take_skin
from sim.writing import whole_file

AXES = "X anterior, Y left, Z up of the body, in every posture"
SINGLE = np.float32
"""Elements are drawn, not integrated: half the size is worth more than the digits."""


def _put(file: h5py.File, name: str, values: object, unit: str) -> h5py.Dataset:
    array = np.asarray(values)
    packed = {"compression": "gzip", "shuffle": True} if array.ndim > 1 else {}
    data = file.create_dataset(name, data=array, **packed)
    data.attrs["unit"] = unit
    return data


def _put_names(file: h5py.File, name: str, names: tuple[str, ...]) -> None:
    file.create_dataset(name, data=list(names), dtype=h5py.string_dtype())


def _fill(file: h5py.File, motion: Motion) -> None:
    _put(file, "time_s", motion.time, "s")
    _put_names(file, "bodies/name", motion.bodies)
    _put_names(file, "bodies/parent", motion.parents)
    _put(file, "bodies/position", motion.position, "m")
    _put(file, "bodies/quaternion", motion.quaternion, "1").attrs["order"] = "w x y z"
    for name, shape in motion.shapes.items():
        vertices = _put(file, f"shapes/{name}/vertices", shape.vertices.astype(SINGLE), "m")
        vertices.parent.attrs.update(body=shape.body, tissue=shape.tissue)
        _put(file, f"shapes/{name}/faces", shape.faces.astype(np.int32), "1")
    for name, soft in motion.soft.items():
        _put(file, f"soft/{name}/vertices", soft.vertices, "m")
        _put(file, f"soft/{name}/faces", soft.faces, "1")
    _put_names(file, "markers/name", motion.marker_names)
    _put(file, "markers/position", motion.markers, "m")
    if motion.measured is not None:
        _put(file, "markers/measured", motion.measured, "m")
    if motion.elements is not None:
        _put_names(file, "elements/group", motion.elements.group)
        _put(file, "elements/tension", motion.elements.tension.astype(SINGLE), "N")
        _put(file, "elements/endpoints", motion.elements.endpoints.astype(SINGLE), "m")
    for name, volume in motion.volumes.items():
        _put(file, f"volumes/{name}", volume, "m^3")
    file["volumes/lung"].attrs["tissue_volume"] = motion.tissue_volume
    for name, pressure in motion.pressures.items():
        _put(file, f"pressures/{name}", pressure, "Pa")
    if motion.rest is not None:
        put_rest(file, motion.rest)
    if motion.skin is not None:
        put_skin(file, motion.skin)


def save_motion(path: Path, motion: Motion, about: Mapping[str, str | int]) -> None:
    """Write a motion; the file appears whole or not at all.

    Parameters
    ----------
    about : attributes of the file: version, seed, style, subject, posture
    """
    motion = dressed(motion)
    with whole_file(path) as temporary, h5py.File(temporary, "w") as file:
        file.attrs.update(about)
        file.attrs["axes"] = AXES
        _fill(file, motion)


def _names(file: h5py.File, name: str) -> tuple[str, ...]:
    return tuple(file[name].asstr()[:].tolist())


def _values(group: h5py.Group) -> dict[str, Floats]:
    return {name: data[:] for name, data in group.items()}


def _shape(group: h5py.Group) -> Shape:
    return Shape(
        body=group.attrs["body"],
        tissue=group.attrs["tissue"],
        vertices=np.asarray(group["vertices"][:], dtype=np.float64),
        faces=np.asarray(group["faces"][:], dtype=np.int64),
    )


def _take(file: h5py.File) -> Motion:
    elements = None
    rest = take_rest(file) if "rest" in file else None
    if "elements" in file:
        elements = Elements(
            group=_names(file, "elements/group"),
            tension=file["elements/tension"][:],
            endpoints=file["elements/endpoints"][:],
        )
    return Motion(
        time=file["time_s"][:],
        bodies=_names(file, "bodies/name"),
        parents=_names(file, "bodies/parent"),
        shapes={name: _shape(group) for name, group in file["shapes"].items()},
        position=file["bodies/position"][:],
        quaternion=file["bodies/quaternion"][:],
        soft={k: Soft(vertices=g["vertices"][:], faces=g["faces"][:])
              for k, g in file["soft"].items()},
        marker_names=_names(file, "markers/name"),
        markers=file["markers/position"][:],
        measured=file["markers/measured"][:] if "markers/measured" in file else None,
        elements=elements,
        volumes=_values(file["volumes"]),
        pressures=_values(file["pressures"]),
        tissue_volume=float(file["volumes/lung"].attrs["tissue_volume"]),
        rest=rest,
        skin=take_skin(file, rest) if rest is not None and "human_skin" in file else None,
    )  # fmt: skip


def load_motion(path: Path) -> tuple[Motion, dict[str, str | int]]:
    """Read a motion and the attributes of its file.

    Raises
    ------
    InputError
        if the file is missing, damaged or not a trajectory
    """
    try:
        with h5py.File(path, "r") as file:
            about = {key: _plain(value) for key, value in file.attrs.items()}
            return _take(file), about
    except FileNotFoundError as error:
        raise InputError(f"{path}: there is no such file. Check its name.") from error
    except (OSError, KeyError, AttributeError, TypeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise InputError(
            f"{path}: is not a trajectory of the torso ({reason}). Make it anew with"
            " 'pleura simulate STYLE --out FILE.h5'."
        ) from error


def _plain(value: object) -> str | int:
    return value if isinstance(value, str) else int(np.asarray(value))
