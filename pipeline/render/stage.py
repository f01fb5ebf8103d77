"""Draws parts: soft light, shadows, and less light where little of the sky is seen.

A picture is drawn finer than it is shown, and the mean of the fine dots is taken.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import moderngl
import numpy as np
from numpy.typing import NDArray

from pipeline.look import linear
from pipeline.render.camera import Camera
from pipeline.render.graphics import Buffers, context, put
from pipeline.render.parts import Part
from pipeline.render.pose import Moment

Floats = NDArray[np.float64]
Picture = NDArray[np.uint8]

SHADERS = Path(__file__).parent / "shaders"
FINER = 2
"""Fine dots along each side of a pixel."""
SHADOW_DOTS = 1536
REACH = 0.06
"""m about a place, within which others take some of its sky."""
KEY = (-0.52, 0.62, 0.60)
"""Towards the main light, in the eye's axes."""
BACKGROUND = ("#ffffff", "#dfe4e6")
"""Middle and rim."""


class Stage:
    """Draws moments of one set of parts in pictures of one size.

    Parameters
    ----------
    parts : what is drawn
    moment : any; it tells how many corners there are
    size : pixels, width and height
    background : `#rrggbb`; "transparent"; or empty for a soft one
    """

    def __init__(
        self, parts: Sequence[Part], moment: Moment, size: tuple[int, int], background: str = ""
    ) -> None:
        self.gl = context()
        self.size, self.fine = size, (FINER * size[0], FINER * size[1])
        self.clear = background == "transparent"
        colours = BACKGROUND if self.clear or not background else (background, background)
        self.middle, self.rim = (tuple(linear(colour)) for colour in colours)
        self._make_programs()
        self._make_pictures()
        meshes = (self.depth, self.surface)
        self.buffers = [
            Buffers(self.gl, part, len(part.source.at(moment).places), meshes) for part in parts
        ]

    def close(self) -> None:
        """Give everything back."""
        self.gl.release()

    def _program(self, vertex: str, fragment: str) -> moderngl.Program:
        return self.gl.program(
            vertex_shader=(SHADERS / f"{vertex}.vert").read_text(encoding="utf-8"),
            fragment_shader=(SHADERS / f"{fragment}.frag").read_text(encoding="utf-8"),
        )

    def _make_programs(self) -> None:
        self.depth = self._program("solid", "away")
        self.surface = self._program("solid", "surface")
        names = ("occlusion", "blur", "resolve")
        self.screen = {name: self._program("screen", name) for name in names}
        self.triangle = {n: self.gl.vertex_array(p, []) for n, p in self.screen.items()}

    def _make_pictures(self) -> None:
        gl = self.gl
        self.away = gl.texture(self.fine, 1, dtype="f4")
        self.away.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self.light = gl.texture(self.fine, 4, dtype="f2")
        ahead = gl.depth_renderbuffer(self.fine)
        self.first = gl.framebuffer([self.away], ahead)
        self.second = gl.framebuffer([self.light], ahead)
        self.open = [gl.texture(self.size, 1, dtype="f2") for _ in range(2)]
        self.opens = [gl.framebuffer([texture]) for texture in self.open]
        for texture in (self.away, *self.open):
            texture.repeat_x = texture.repeat_y = False
        self.shadow = gl.depth_texture((SHADOW_DOTS, SHADOW_DOTS))
        self.shadow.compare_func = "<="
        self.shadow.repeat_x = self.shadow.repeat_y = False
        self.dark = gl.framebuffer(depth_attachment=self.shadow)
        self.out = gl.framebuffer([gl.texture(self.size, 4)])

    def draw(self, moment: Moment, camera: Camera) -> Picture:
        """Return a moment as (height, width, 4) dots."""
        places = np.concatenate([buffers.fill(moment) for buffers in self.buffers])
        self._draw_shadow(places, camera)
        self._draw_depth(camera)
        self._draw_open(camera)
        self._draw_light(camera)
        return self._resolved()

    def _light_view(self, places: Floats, camera: Camera) -> tuple[Floats, Floats]:
        """Axes of the light and what they show, about all that is drawn."""
        way = camera.view[:3, :3].T @ (np.array(KEY) / np.linalg.norm(KEY))
        right = np.cross([0.0, 0.0, 1.0], way)
        right /= np.linalg.norm(right)
        middle = 0.5 * (places.min(axis=0) + places.max(axis=0))
        radius = float(np.linalg.norm(places - middle, axis=1).max()) + 0.02
        view = np.eye(4)
        view[:3, :3] = np.stack([right, np.cross(way, right), way])
        view[:3, 3] = -view[:3, :3] @ middle
        return view, np.diag([1.0 / radius, 1.0 / radius, -1.0 / radius, 1.0])

    def _draw_shadow(self, places: Floats, camera: Camera) -> None:
        view, projection = self._light_view(places, camera)
        self.to_light = projection @ view @ np.linalg.inv(camera.view)
        self.dark.use()
        self.dark.clear(depth=1.0)
        self.gl.enable_only(moderngl.DEPTH_TEST)
        put(self.depth, view=view, projection=projection, nearer=0.0)
        for buffers in self.buffers:
            if buffers.part.solid:
                buffers.drawn[self.depth].render()

    def _draw_depth(self, camera: Camera) -> None:
        self.first.use()
        self.first.clear(0.0, 0.0, 0.0, 0.0, depth=1.0)
        put(self.depth, view=camera.view, projection=camera.projection)
        for buffers in self.buffers:
            if buffers.part.solid:
                put(self.depth, nearer=buffers.part.nearer)
                buffers.drawn[self.depth].render()

    def _draw_open(self, camera: Camera) -> None:
        """Find how much of the sky each place sees."""
        self.gl.disable(moderngl.DEPTH_TEST)
        self.away.use(0)
        self.opens[0].use()
        put(self.screen["occlusion"], away=0, tangents=camera.tangents, reach=REACH)
        self.triangle["occlusion"].render(vertices=3)
        self.open[0].use(1)
        self.opens[1].use()
        put(self.screen["blur"], away=0, open=1, reach=REACH)
        self.triangle["blur"].render(vertices=3)

    def _draw_light(self, camera: Camera) -> None:
        gl = self.gl
        # what is nearest stays known from before
        self._write_to(colour=True, depth=False)
        self.second.clear(0.0, 0.0, 0.0, 0.0)
        self.open[1].use(0)
        self.shadow.use(1)
        key = np.array(KEY) / np.linalg.norm(KEY)
        put(
            self.surface, view=camera.view, projection=camera.projection, open=0, shadow=1,
            to_light=self.to_light, up=tuple(camera.view[:3, 2].tolist()), key=tuple(key.tolist()),
            size=tuple(map(float, self.fine)),
        )  # fmt: skip
        gl.enable_only(moderngl.DEPTH_TEST)
        gl.depth_func = "<="
        for solid in (True, False):
            for buffers in self.buffers:
                if buffers.part.solid == solid:
                    self._draw_part(buffers, camera)

    def _draw_part(self, buffers: Buffers, camera: Camera) -> None:
        """Draw a part: of glass its far side first, of bone seen through what is nearest alone."""
        gl, part = self.gl, buffers.part
        if not (part.solid or part.glass):
            self._hide_behind(buffers, camera)
        put(
            self.surface, opacity=part.opacity, solid=part.solid, glass=part.glass,
            nearer=part.nearer,
        )  # fmt: skip
        drawn = buffers.drawn[self.surface]
        if part.solid:
            drawn.render()
            return
        gl.enable(moderngl.BLEND | moderngl.CULL_FACE)
        gl.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
        for side in ("front", "back") if part.glass else ("back",):
            gl.cull_face = side
            drawn.render()
        gl.disable(moderngl.BLEND | moderngl.CULL_FACE)

    def _hide_behind(self, buffers: Buffers, camera: Camera) -> None:
        """Let a part hide what lies behind it from here on, before it is drawn itself."""
        self._write_to(colour=False, depth=True)
        put(self.depth, view=camera.view, projection=camera.projection, nearer=0.0)
        buffers.drawn[self.depth].render()
        self._write_to(colour=True, depth=False)

    def _write_to(self, *, colour: bool, depth: bool) -> None:
        self.second.color_mask = (colour,) * 4
        self.second.depth_mask = depth
        # what is masked counts from the next use on
        self.second.use()

    def _resolved(self) -> Picture:
        self.gl.disable(moderngl.DEPTH_TEST)
        self.light.use(0)
        self.out.use()
        put(
            self.screen["resolve"], fine=0, middle=self.middle, rim=self.rim, clear=self.clear,
            aspect=self.size[0] / self.size[1], times=FINER,
        )  # fmt: skip
        self.triangle["resolve"].render(vertices=3)
        dots = np.frombuffer(self.out.read(components=4, alignment=1), dtype=np.uint8)
        return dots.reshape(self.size[1], self.size[0], 4)[::-1].copy()
