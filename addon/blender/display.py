# SPDX-License-Identifier: GPL-3.0-or-later
"""What the image editor shows while a picture is rendered: its pixels in order.

Blender lets the engine draw there.  Cycles would draw its own pixels: those of GATHER are out of order, and a
sub-frame is a small picture in a corner.  Everything is drawn in linear light, in pixels of the full frame.  Textures
live for one drawing only: an engine, and what it holds, is freed by the thread that renders, which has no graphics
context.
"""

import functools

import blf
import gpu
import numpy as np
from gpu_extras.batch import batch_for_shader
from gpu_extras.presets import draw_texture_2d
from mathutils import Matrix

# Larger pictures are shown as Cycles has them: moving their pixels again and again would take its time.
_MOST_PIXELS = 2**24

# Size of letters on the screen.
_LETTER = 14


class InOrder:
    """Cycles' picture so far of a region, every pixel where it belongs by a plan."""

    def __init__(self, region, plan):
        self._region = region
        self._plan = plan
        self._servants = None

    def draw(self, space, draw_cycles):
        """Draw what `draw_cycles()` would draw, in order."""
        if self._region.pixels > _MOST_PIXELS:
            return draw_cycles()
        size = self._region.size
        left, bottom = self._region.corner
        right, top = left + size[0], bottom + size[1]
        if self._servants is None:
            self._servants = _servants(self._plan)
        servants = _texture(self._servants, size, "RG32F")
        editor = gpu.state.active_framebuffer_get()
        raw = gpu.types.GPUOffScreen(*size, format="RGBA16F")  # leaves another one active
        with raw.bind(), gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
            gpu.state.active_framebuffer_get().clear(color=(0.0, 0.0, 0.0, 0.0))
            gpu.matrix.load_identity()
            # From pixels of the region to -1 ... 1.
            scale = Matrix.Diagonal((2.0 / size[0], 2.0 / size[1], 1.0, 1.0))
            to_corner = Matrix.Translation((-left, -bottom, 0.0))
            gpu.matrix.load_projection_matrix(Matrix.Translation((-1.0, -1.0, 0.0)) @ scale @ to_corner)
            draw_cycles()
        shader = _shader()
        shader.bind()
        shader.uniform_sampler("raw", raw.texture_color)
        shader.uniform_sampler("servants", servants)
        corners = {
            "position": [(left, bottom), (right, bottom), (left, top), (right, top)],
            "inside": [(0, 0), (size[0], 0), (0, size[1]), size],
        }
        with editor.bind():
            gpu.state.blend_set("ALPHA_PREMULT")
            batch_for_shader(shader, "TRI_STRIP", corners).draw(shader)
            gpu.state.blend_set("NONE")


class Picture:
    """A picture of ours.

    Parameters
    ----------
    region : Region
    pixels : float32 array, shape (pixels, 4)
        Rows from the bottom.
    line : str
        Shown below it.
    """

    def __init__(self, region, pixels, line=""):
        self._region = region
        self._pixels = pixels
        self._line = line

    def draw(self, space, _draw_cycles):
        """Draw it into `space`, the image editor."""
        size, (left, bottom) = self._region.size, self._region.corner
        gpu.state.blend_set("ALPHA_PREMULT")
        draw_texture_2d(_texture(self._pixels, size, "RGBA16F"), (left, bottom), *size)
        letter = _LETTER / space.zoom[1]
        blf.size(0, letter)
        blf.position(0, left, bottom - 1.5 * letter, 0.0)
        blf.draw(0, self._line)
        gpu.state.blend_set("NONE")


def _texture(pixels, size, kind):
    return gpu.types.GPUTexture(size, format=kind, data=gpu.types.Buffer("FLOAT", pixels.size, pixels.ravel()))


def _servants(plan):
    """Column and row of the render pixel that serves each film pixel: (pixels, 2)."""
    servants = np.empty_like(plan.film)
    servants[plan.film] = np.arange(plan.film.size)
    row, column = np.divmod(servants, np.int32(plan.width))
    return np.stack([column, row], axis=1).astype(np.float32)


@functools.cache
def _shader():
    pixel = gpu.types.GPUStageInterfaceInfo("spectral_tiles_pixel")
    pixel.smooth("VEC2", "pixel")
    info = gpu.types.GPUShaderCreateInfo()
    info.push_constant("MAT4", "ModelViewProjectionMatrix")
    info.sampler(0, "FLOAT_2D", "raw")
    info.sampler(1, "FLOAT_2D", "servants")
    info.vertex_in(0, "VEC2", "position")
    info.vertex_in(1, "VEC2", "inside")
    info.vertex_out(pixel)
    info.fragment_out(0, "VEC4", "colour")
    info.vertex_source(
        "void main() { pixel = inside; gl_Position = ModelViewProjectionMatrix * vec4(position, 0.0, 1.0); }"
    )
    info.fragment_source(
        "void main() { colour = texelFetch(raw, ivec2(texelFetch(servants, ivec2(pixel), 0).xy), 0); }"
    )
    return gpu.shader.create_from_info(info)
