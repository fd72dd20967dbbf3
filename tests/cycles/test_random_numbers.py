# SPDX-License-Identifier: GPL-3.0-or-later
"""The probe: scenes whose pixels show the random numbers that Cycles drew.

When a Blender release changes Cycles' sampler, these tests fail, and `addon/cycles/random_numbers.py` must follow.
"""

import bpy
import numpy as np
import pytest

from addon.cycles import random_numbers
from tests import rendering

SIZE = 48
SEED = 7


def expected(dims, samples=1, sample=0):
    """Our prediction, (height, width, dims), rows from the top as in a render."""
    y, x = np.mgrid[0:SIZE, 0:SIZE]
    index = random_numbers.pixel_ranks(x, y, SEED) * np.uint32(samples) + np.uint32(sample)
    return random_numbers.sequence_values(index, dims)[::-1]


def native(folder):
    bpy.context.scene.cycles.sampling_pattern = "BLUE_NOISE"
    return rendering.beauty(rendering.render(folder, "CYCLES", seed=SEED))[..., :3]


def test_light_numbers(tmp_path):
    """An area light that shines its own parametric coordinate: the ratios of a lit pixel's colours are (u, v)."""
    rendering.empty_scene(SIZE, SIZE)
    rendering.add_camera(type="ORTHO", ortho_scale=0.1)
    rendering.add_plane(10, rendering.diffuse())
    rendering.add_parametric_light()
    image = native(tmp_path)
    seen = image[..., :2] / image[..., 2:]
    wanted = expected(("light.u", "light.v"))
    # Seen from far, the light's solid-angle sampling is uniform on its surface, whose axes may run the other way.
    for axis in (0, 1):
        error = np.minimum(np.abs(seen - wanted).max(axis=(0, 1)), np.abs(1 - seen - wanted).max(axis=(0, 1)))
        assert error[axis] < 1e-3


def test_time_numbers(tmp_path):
    """A ramp that slides by one unit during the shutter shows the time."""
    scene = rendering.empty_scene(SIZE, SIZE)
    rendering.add_camera(type="ORTHO", ortho_scale=1e-4)
    material = rendering.emission()

    def ramp(tree):
        return tree.nodes.new("ShaderNodeTexCoord").outputs["Object"]

    rendering.emit(material.node_tree, "ShaderNodeOutputMaterial", ramp)
    plane = rendering.add_plane(20, material)
    rendering.slide(plane, (-1, 0, 0), (-3, 0, 0))
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter = 1.0
    scene.render.motion_blur_position = "START"
    seen = native(tmp_path)[..., 0]
    time = seen - 2.0  # the ramp reads 2 at the shutter's opening, 3 at its closing
    assert np.abs(time - expected(("t",))[..., 0]).max() < 0.01


def test_lens_numbers(tmp_path):
    """Out of focus by a known amount, the position that a ray hits tells where it passed the lens."""
    rendering.empty_scene(SIZE, SIZE)
    camera = rendering.add_camera((0, 0, 2), type="ORTHO", ortho_scale=1e-4)
    camera.data.dof.use_dof = True
    camera.data.dof.focus_distance = 1.0
    camera.data.dof.aperture_fstop = 0.5
    material = rendering.emission()

    def position(tree):
        shifted = tree.nodes.new("ShaderNodeVectorMath")
        tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], shifted.inputs[0])
        shifted.inputs[1].default_value = (5, 5, 5)
        return shifted.outputs[0]

    rendering.emit(material.node_tree, "ShaderNodeOutputMaterial", position)
    rendering.add_plane(20, material)
    # Twice the focus distance away, the hit is the lens point mirrored.
    seen = 5.0 - native(tmp_path)[..., :2]
    u, v = np.moveaxis(expected(("lens.u", "lens.v")).astype(float), -1, 0)
    a, b = 2 * u - 1, 2 * v - 1
    wide = a * a > b * b
    radius = np.where(wide, a, b)
    angle = np.where(wide, np.pi / 4 * b / a, np.pi / 2 - np.pi / 4 * a / b)
    assert np.abs(seen[..., 0] - radius * np.cos(angle)).max() < 1e-3
    assert np.abs(seen[..., 1] - radius * np.sin(angle)).max() < 1e-3


def test_bsdf_numbers(tmp_path):
    """Under a world that shines its own direction, a diffuse plane shows where its BSDF sent the ray."""
    scene = rendering.empty_scene(SIZE, SIZE)
    rendering.add_camera(type="ORTHO", ortho_scale=2)
    rendering.add_plane(10, rendering.diffuse((1, 1, 1)))
    world = rendering.set_world((1, 1, 1))
    world.cycles.sampling_method = "NONE"
    tree = world.node_tree
    shifted = tree.nodes.new("ShaderNodeVectorMath")
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Incoming"], shifted.inputs[0])
    shifted.inputs[1].default_value = (2, 2, 2)
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    tree.links.new(shifted.outputs[0], background.inputs["Color"])
    scene.cycles.max_bounces = 1
    direction = 2.0 - native(tmp_path)
    # Cycles' frame about (0, 0, 1) has its axes along (1, -1, 0) and (1, 1, 0) (util/math_float3.h, make_orthonormals).
    t = (direction[..., 0] - direction[..., 1]) / np.sqrt(2)
    b = (direction[..., 0] + direction[..., 1]) / np.sqrt(2)
    u, v = np.moveaxis(expected(("bsdf.u", "bsdf.v")).astype(float), -1, 0)
    assert np.abs(t * t + b * b - np.maximum(np.abs(2 * u - 1), np.abs(2 * v - 1)) ** 2).max() < 1e-3


def test_several_samples_take_consecutive_points():
    """n points of a pixel are a block of the sequence, so they hit each of n strata once."""
    samples = 16
    y, x = np.mgrid[0:8, 0:8]
    first = random_numbers.pixel_ranks(x, y, SEED)[..., None] * np.uint32(samples)
    t = random_numbers.sequence_values(first + np.arange(samples, dtype=np.uint32), ("t",))[..., 0]
    assert (np.sort((t * samples).astype(int), axis=-1) == np.arange(samples)).all()


def test_leading_bytes_are_the_values_cut_off():
    index = np.random.default_rng(0).integers(0, 2**32, 5000, dtype=np.uint32)
    dims = tuple(random_numbers.DIMENSIONS)
    leading = random_numbers.leading_bytes(index, dims)
    values = random_numbers.sequence_values(index, dims)
    rest = 256 * values - np.stack([leading[name] for name in dims], axis=-1)
    # Cycles scales by a little less than 2^-32.
    assert rest.min() > -1e-4 and rest.max() < 1


def test_unknown_dimension_is_named():
    with pytest.raises(ValueError, match=r"film\.x"):
        random_numbers.sequence_values(np.zeros(1, np.uint32), ("film.x",))


@pytest.mark.parametrize("subframe", [0.0, 0.25])
def test_the_animated_seed_is_cycles(tmp_path, subframe):
    """A picture with it is that of the seed that we compute, where that is one that a user can set."""
    scene = rendering.empty_scene(8, 8)
    rendering.add_camera()
    rendering.add_plane(20, rendering.diffuse())
    rendering.add_light("AREA", 100, (0, 0, 3), size=2)
    frame = next(n for n in range(1, 99) if random_numbers.animated_seed(7, n, subframe) < 2**31)
    scene.frame_set(frame, subframe=subframe)
    scene.cycles.use_animated_seed = True
    animated = rendering.beauty(rendering.render(tmp_path, "CYCLES", seed=7))
    scene.cycles.use_animated_seed = False
    seed = random_numbers.animated_seed(7, frame, subframe)
    assert np.array_equal(animated, rendering.beauty(rendering.render(tmp_path, "CYCLES", seed=seed)))
