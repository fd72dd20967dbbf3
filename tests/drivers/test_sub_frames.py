# SPDX-License-Identifier: GPL-3.0-or-later
"""The method Sub-Frames: whatever changes blurs, what is excluded does not, and the user's scene stays as it was."""

import math

import bpy
import numpy as np
import pytest

from addon.blender.evaluated import render_settings
from addon.interface import forecast
from tests import rendering

MOMENTS = 8


def build(change, samples=MOMENTS):
    """A small scene whose shutter is open from frame 1 to 2, in which something changes."""
    scene = rendering.empty_scene(16, 12)
    rendering.add_camera((0, 0, 6), lens=30.0)
    rendering.add_plane(9, rendering.diffuse((0.6, 0.5, 0.4)))
    card = rendering.add_plane(1.5, rendering.emission((0.4, 0.8, 0.2)), (-0.6, 0.3, 1))
    rendering.add_light("AREA", 90, (2, 1, 3), size=1.0)
    rendering.set_world((0.1, 0.1, 0.2))
    change(card)
    scene.frame_set(1)
    scene.render.use_motion_blur = True
    scene.render.motion_blur_shutter, scene.render.motion_blur_position = 1.0, "START"
    scene.spectral_tiles.method, scene.spectral_tiles.sub_frames = "SUB_FRAMES", MOMENTS
    scene.cycles.samples = samples
    return scene


def animate(owner, path, values, animated=None):
    """Keyframes of a value at frames 1, 1.5 and 2, linear between them."""
    for frame, value in zip((1, 1.5, 2), values, strict=True):
        setattr(owner, path, value)
        owner.keyframe_insert(path, frame=frame)
    rendering.make_linear(animated or owner)


def node_value(tree, kind, name, values):
    socket = next(node for node in tree.nodes if node.type == kind).inputs[name]
    animate(socket, "default_value", values, tree)


def light_energy(card):
    animate(bpy.data.lights["Area"], "energy", (90, 400, 10))


def material(card):
    node_value(card.data.materials[0].node_tree, "EMISSION", "Strength", (0.0, 3.0, 1.0))


def world(card):
    node_value(bpy.context.scene.world.node_tree, "BACKGROUND", "Strength", (0.0, 5.0, 1.0))


def visibility(card):
    for frame, hidden in ((1, False), (1.5, True)):
        card.hide_render = hidden
        card.keyframe_insert("hide_render", frame=frame)


def topology(card):
    array = card.modifiers.new("Array", "ARRAY")
    for frame, count in ((1, 1), (1.4, 2), (1.8, 3)):
        array.count = count
        array.keyframe_insert("count", frame=frame)


def geometry_nodes(card):
    """Subdivides the card ever finer, and enlarges it."""
    tree = bpy.data.node_groups.new("Nodes", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    source, target = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    subdivide, enlarge = tree.nodes.new("GeometryNodeSubdivideMesh"), tree.nodes.new("GeometryNodeTransform")
    time = tree.nodes.new("GeometryNodeInputSceneTime")
    tree.links.new(source.outputs[0], subdivide.inputs["Mesh"])
    tree.links.new(time.outputs["Frame"], subdivide.inputs["Level"])
    tree.links.new(subdivide.outputs[0], enlarge.inputs["Geometry"])
    tree.links.new(time.outputs["Frame"], enlarge.inputs["Scale"])
    tree.links.new(enlarge.outputs[0], target.inputs[0])
    card.modifiers.new("Nodes", "NODES").node_group = tree


def driver(card):
    curve = card.driver_add("location", 0)
    curve.driver.expression = "frame - 1.5"


def focus(card):
    dof = bpy.context.scene.camera.data.dof
    dof.use_dof, dof.aperture_fstop = True, 0.1
    animate(dof, "focus_distance", (5.0, 2.0, 6.0), bpy.context.scene.camera.data)


def lens(card):
    animate(bpy.context.scene.camera.data, "lens", (30, 50, 25))


def movement(card):
    animate(card, "location", ((-1, 0, 1), (0, 1, 1), (1, 0, 1)))


CHANGES = (
    light_energy, material, world, visibility, topology, geometry_nodes, driver, focus, lens, movement,
)  # fmt: skip


def ours(folder, samples=MOMENTS, seed=0):
    return rendering.render(folder, "SPECTRAL_TILES", samples, seed)


def mean_of_moments(folder, samples=MOMENTS, moments=MOMENTS):
    """What native renders at the moments say together, each of its part of the samples."""
    scene, cycles = bpy.context.scene, bpy.context.scene.cycles
    scene.render.use_motion_blur = False
    cycles.sampling_pattern, cycles.use_sample_subset = "BLUE_NOISE", True
    found = []
    for moment in range(moments):
        time = 1 + (moment + 0.5) / moments
        scene.frame_set(math.floor(time), subframe=time % 1.0)
        cycles.sample_offset, cycles.sample_subset_length = samples * moment // moments, samples // moments
        found.append(rendering.beauty(rendering.render(folder, "CYCLES", samples)))
    scene.frame_set(1)
    scene.render.use_motion_blur, cycles.use_sample_subset = True, False
    return np.mean(found, axis=0)


@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.__name__)
def test_whatever_changes_is_blurred(tmp_path, change):
    """A picture is the mean of native ones at the moments; and no single one of these."""
    build(change).render.use_motion_blur = False
    still = rendering.beauty(rendering.render(tmp_path, "CYCLES", 64))
    bpy.context.scene.render.use_motion_blur = True
    seen = rendering.beauty(ours(tmp_path))
    wanted = mean_of_moments(tmp_path)
    np.testing.assert_allclose(seen, wanted, rtol=1e-4, atol=1e-5)
    assert np.abs(still - wanted).max() > 0.05


@pytest.mark.parametrize(("samples", "kind"), [(1, "BLACKMAN_HARRIS"), (2, "BOX"), (4, "GAUSSIAN")])
def test_fewer_samples_than_moments(tmp_path, samples, kind):
    """Each moment gets some of the pixels, in which it is seen as in all."""

    def both(card):
        light_energy(card)
        lens(card)
        focus(card)

    scene = build(both)
    scene.cycles.pixel_filter_type = kind
    scene.render.use_border = scene.render.use_crop_to_border = True
    scene.render.border_min_x, scene.render.border_max_y = 0.2, 0.8
    found = rendering.stack(tmp_path, "SPECTRAL_TILES", range(16), samples)
    wanted = rendering.stack(tmp_path, "SPECTRAL_TILES", range(6), 16)
    rendering.assert_same_expectation(found, wanted, block=4)


def test_shutter_curve(tmp_path):
    """Moments lie where the shutter is open: here late."""

    def brighten(card):
        animate(bpy.data.lights["Area"], "energy", (0, 200, 400))
        bpy.context.scene.world = None

    scene = build(brighten)
    curve = scene.render.motion_blur_shutter_curve
    first, *_, last = curve.curves[0].points
    first.location[1], last.location[1] = 0.0, 1.0
    curve.update()
    curve.initialize()
    times = (np.arange(1000) + 0.5) / 1000
    opening = np.array([curve.evaluate(curve.curves[0], time) for time in times])
    late = (times * opening).sum() / opening.sum()
    assert late > 0.55
    scene.objects["Plane.001"].hide_render = True
    blurred = rendering.beauty(ours(tmp_path, 64))
    scene.render.use_motion_blur = False
    bpy.data.lights["Area"].animation_data_clear()
    bpy.data.lights["Area"].energy = 400 * late
    even = rendering.beauty(rendering.render(tmp_path, "CYCLES", 64))
    assert blurred[..., :3].mean() == pytest.approx(even[..., :3].mean(), rel=0.02)


@pytest.mark.parametrize("moves", [False, True], ids=["deformation", "motion"])
def test_what_is_excluded_stands_still(tmp_path, moves):
    """An object without Motion Blur is where it is at the frame, one without Deformation has that shape."""

    def excluded(card):
        card.shape_key_add(name="Basis")
        key = card.shape_key_add(name="Wide")
        for point in key.data:
            point.co *= 2
        animate(key, "value", (0.0, 1.0, 0.5), card.data.shape_keys)
        if moves:
            movement(card)
            card.cycles.use_motion_blur = False
        card.cycles.use_deform_motion = False

    scene = build(excluded)
    seen = rendering.beauty(ours(tmp_path, 64))
    scene.render.use_motion_blur = False
    still = rendering.beauty(rendering.render(tmp_path, "CYCLES", 64))
    np.testing.assert_allclose(seen, still, atol=0.02)
    scene.render.use_motion_blur = True
    card = scene.objects["Plane.001"]
    card.cycles.use_motion_blur = card.cycles.use_deform_motion = True
    assert np.abs(rendering.beauty(ours(tmp_path, 64)) - still).max() > 0.1


def test_a_camera_that_is_excluded_stands_still(tmp_path):
    def swing(card):
        lens(card)
        animate(bpy.context.scene.camera, "location", ((0, 0, 6), (1, 0, 6), (2, 0, 5)))

    scene = build(swing)
    scene.camera.cycles.use_motion_blur = False
    seen = rendering.beauty(ours(tmp_path, 64))
    scene.render.use_motion_blur = False
    np.testing.assert_allclose(seen, rendering.beauty(rendering.render(tmp_path, "CYCLES", 64)), atol=1e-4)


def test_handlers_see_the_moments(tmp_path):
    """One that changes data at each change of frame is heeded, and the scene ends at its frame."""
    scene = build(lambda card: None)
    times = []

    def flash(scene, depsgraph=None):
        times.append(scene.frame_current_final)
        bpy.data.lights["Area"].energy = 400 * (scene.frame_current_final - 1)

    bpy.app.handlers.frame_change_pre.append(flash)
    try:
        seen = rendering.beauty(ours(tmp_path))
        wanted = [1 + (moment + 0.5) / MOMENTS for moment in range(MOMENTS)]
        assert [time for time in times if time != 1] == pytest.approx(wanted)
        assert times[-1] == 1 and bpy.data.lights["Area"].energy == 0
        np.testing.assert_allclose(seen, mean_of_moments(tmp_path), rtol=1e-4, atol=1e-5)
    finally:
        bpy.app.handlers.frame_change_pre.remove(flash)
    assert scene.frame_current_final == 1


def test_a_file_saved_meanwhile_is_the_users(tmp_path, monkeypatch):
    """The timeline stands still, at a sub-frame, too; Persistent Data is as the user set it."""
    from addon.cycles import session

    scene = build(light_energy)
    scene.frame_set(1, subframe=0.25)
    found, read = [], session.passes.read

    def save(*arguments):
        path = str(tmp_path / f"{len(found)}.blend")
        bpy.ops.wm.save_as_mainfile(filepath=path, copy=True)
        found.append((scene.frame_current, scene.frame_subframe, scene.render.use_persistent_data, path))
        return read(*arguments)

    monkeypatch.setattr(session.passes, "read", save)
    ours(tmp_path)
    assert len(found) == MOMENTS
    assert {moment[:3] for moment in found} == {(1, 0.25, False)}
    for path in (found[0][3], found[-1][3]):
        with bpy.data.libraries.load(path) as (source, target):
            target.scenes = source.scenes
        for saved in target.scenes:
            assert (saved.frame_current, saved.frame_subframe) == (1, 0.25)
            bpy.data.scenes.remove(saved)


def test_persistent_data(tmp_path):
    """Only changes are read then; the picture is the same, in an animation, too."""
    scene = build(topology)
    movement(scene.objects["Plane.001"])
    scene.frame_set(1)
    plain = ours(tmp_path)
    scene.render.use_persistent_data = True
    for _ in range(2):
        again = ours(tmp_path)
        np.testing.assert_array_equal(rendering.beauty(again), rendering.beauty(plain))
    scene.render.use_persistent_data = False


def test_every_pass_and_a_second_view_layer(tmp_path):
    scene = build(movement)
    other = scene.view_layers.new("Other")
    for layer in (bpy.context.view_layer, other):
        layer.use_pass_z = layer.use_pass_normal = layer.use_pass_object_index = True
        layer.use_pass_diffuse_direct = layer.use_pass_cryptomatte_object = True
    passes = ours(tmp_path)
    wanted = mean_of_moments(tmp_path)
    for layer in ("ViewLayer", "Other"):
        np.testing.assert_allclose(passes[f"{layer}.Combined"], wanted, rtol=1e-4, atol=1e-5)
        assert (passes[f"{layer}.Depth"] > 0).all()
        assert np.isfinite(passes[f"{layer}.Diffuse Direct"]).all()
    few = ours(tmp_path, 1)
    assert (few["ViewLayer.Depth"] > 0).all()


def test_cancelled_soon(tmp_path, monkeypatch):
    """What was done until then is shown."""
    from addon.drivers import shots

    build(light_energy)
    first = None
    made = shots.Shots.__init__

    def impatient(self, session, *more):
        session.engine = rendering.CancelledSoon(session.engine, 6)
        made(self, session, *more)

    monkeypatch.setattr(shots.Shots, "__init__", impatient)
    first = rendering.beauty(ours(tmp_path))
    assert first[..., :3].min() > 0 and bpy.context.scene.frame_current_final == 1


def test_a_filter_of_ours(tmp_path):
    scene = build(lens)
    scene.spectral_tiles.filter, scene.spectral_tiles.filter_width = "TENT", 3.0
    few = rendering.stack(tmp_path, "SPECTRAL_TILES", range(12), 2)
    many = rendering.stack(tmp_path, "SPECTRAL_TILES", range(6), 16)
    rendering.assert_same_expectation(few, many, block=4)


def test_layers_of_a_farm_make_the_whole(tmp_path):
    scene = build(light_energy)
    whole = rendering.beauty(ours(tmp_path, 16))
    scene.cycles.use_sample_subset = True
    parts = []
    for first, count in ((0, 5), (5, 11)):
        scene.cycles.sample_offset, scene.cycles.sample_subset_length = first, count
        parts.append(count / 16 * rendering.beauty(ours(tmp_path, 16)))
    np.testing.assert_allclose(sum(parts), whole, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("method", ["SUB_FRAMES", "GATHER", "AUTO"])
def test_a_subset_beyond_the_last_sample_is_cycles_own(tmp_path, method):
    scene = build(light_energy)
    scene.spectral_tiles.method = method
    scene.cycles.use_sample_subset, scene.cycles.sample_offset, scene.cycles.sample_subset_length = True, 64, 4
    # It ends, with whatever is in Cycles' memory: of no samples two pictures of its own differ, too.
    rendering.render(tmp_path, "SPECTRAL_TILES", 8)
    assert forecast.chosen(scene, bpy.context.view_layer).method == "CYCLES"


def test_without_motion_blur_it_is_cycles_own_picture(tmp_path):
    scene = build(light_energy)
    scene.render.use_motion_blur = False
    scene.cycles.sampling_pattern = "BLUE_NOISE"
    native = rendering.beauty(rendering.render(tmp_path, "CYCLES", 4))
    np.testing.assert_allclose(rendering.beauty(ours(tmp_path, 4)), native, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize(
    ("change", "samples", "message"),
    [
        (lambda scene: setattr(scene.cycles, "rolling_shutter_type", "TOP"), 8, "rolling shutter"),
        (lambda scene: setattr(scene.camera.data, "type", "CUSTOM"), 4, "custom"),
        (lambda scene: setattr(bpy.context.view_layer, "use_pass_vector", True), 4, "Vector pass"),
        (lambda scene: setattr(scene, "camera", None), 8, "no camera"),
    ],
)
def test_what_it_cannot_do_is_named(tmp_path, change, samples, message):
    change(build(light_energy))
    with pytest.raises(RuntimeError, match=message):
        ours(tmp_path, samples)


def settings_seen(monkeypatch):
    """Whether data are kept, as each call finds it: by the render, by the user's scene, by the evaluated one."""
    from addon.cycles import session

    found, call = [], session.Session.call

    def look(self, *arguments, **more):
        scenes = self.original_scene, self.scene
        kept = (render_settings(self.engine), *(scene.render for scene in scenes))
        found.append(tuple(render.use_persistent_data for render in kept))
        return call(self, *arguments, **more)

    monkeypatch.setattr(session.Session, "call", look)
    return found


def test_what_is_read_is_kept_without_the_users_setting(tmp_path, monkeypatch):
    """... for a still and an animation, of which each frame is what it is by itself, and not longer."""
    found = settings_seen(monkeypatch)
    scene = build(topology)
    movement(scene.objects["Plane.001"])
    scene.view_layers.new("Other")
    stills = []
    for frame in (1, 2):
        scene.frame_set(frame)
        stills.append(ours(tmp_path))
    scene.frame_start, scene.frame_end, scene.render.filepath = 1, 2, str(tmp_path / "animation_")
    bpy.ops.render.render(animation=True)
    for still, path in zip(stills, sorted(tmp_path.glob("animation_*.exr")), strict=True):
        for name, pixels in rendering.read_exr(path).items():
            if name.endswith("Combined"):
                np.testing.assert_allclose(pixels, still[name], rtol=1e-4, atol=1e-5)
    assert set(found) == {(True, False, False)} and len(found) == 8 * MOMENTS
    scene.spectral_tiles.method = "IN_PLACE"
    ours(tmp_path)
    assert found[-1] == (False, False, False)


def test_a_refused_render_leaves_the_users_setting(tmp_path):
    scene = build(light_energy)
    scene.camera = None
    with pytest.raises(RuntimeError):
        ours(tmp_path)
    assert not scene.render.use_persistent_data
    scene.render.use_persistent_data = True
    with pytest.raises(RuntimeError):
        ours(tmp_path)
    assert scene.render.use_persistent_data
    scene.render.use_persistent_data = False
