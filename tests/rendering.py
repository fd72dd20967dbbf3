# SPDX-License-Identifier: GPL-3.0-or-later
"""Small scenes, renders as arrays, and the statistics that compare them."""

import contextlib

import bpy
import numpy as np

from addon.blender import openimageio

#: Cycles by itself, and with the switch on.
ENGINES = ("CYCLES", "SPECTRAL_TILES")


def empty_scene(width=32, height=32):
    """Factory-fresh scene without objects, one sample a pixel, no denoising, box filter."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.cycles.samples = 1
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.cycles.use_animated_seed = False
    scene.cycles.pixel_filter_type = "BOX"
    scene.view_settings.view_transform = "Standard"
    return scene


def add(data, location=(0, 0, 0), rotation=(0, 0, 0)):
    """Link an object with this data into the scene."""
    made = bpy.data.objects.new(data.name if data else "Empty", data)
    made.location, made.rotation_euler = location, rotation
    bpy.context.scene.collection.objects.link(made)
    return made


def add_camera(location=(0, 0, 10), rotation=(0, 0, 0), **settings):
    """Add a camera and make it the scene's; keywords set properties of its data."""
    camera = add(bpy.data.cameras.new("Camera"), location, rotation)
    for name, value in settings.items():
        setattr(camera.data, name, value)
    bpy.context.scene.camera = camera
    return camera


def add_plane(size, material=None, location=(0, 0, 0), rotation=(0, 0, 0)):
    """Add a square in the xy plane that faces +z."""
    mesh = bpy.data.meshes.new("Plane")
    half = size / 2
    mesh.from_pydata([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)], [], [(0, 1, 2, 3)])
    if material:
        mesh.materials.append(material)
    return add(mesh, location, rotation)


def add_light(kind, energy, location, rotation=(0, 0, 0), **settings):
    """Add a lamp; keywords set properties of its data."""
    light = bpy.data.lights.new(kind.title(), kind)
    light.energy = energy
    for name, value in settings.items():
        setattr(light, name, value)
    return add(light, location, rotation)


def diffuse(color=(0.8, 0.8, 0.8)):
    """Material with one diffuse closure."""
    return _one_node_material("ShaderNodeBsdfDiffuse", "BSDF", Color=(*color, 1))


def glossy(roughness=0.2):
    """Material with one glossy closure."""
    return _one_node_material("ShaderNodeBsdfAnisotropic", "BSDF", Roughness=roughness)


def emission(color=(1, 1, 1), strength=1.0):
    """Material that only emits."""
    return _one_node_material("ShaderNodeEmission", "Emission", Color=(*color, 1), Strength=strength)


def _one_node_material(kind, output, **inputs):
    material = bpy.data.materials.new(kind)
    tree = material.node_tree
    tree.nodes.clear()
    node = tree.nodes.new(kind)
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    tree.links.new(node.outputs[output], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    return material


def emit(tree, output_type, source):
    """Replace a node tree by: `source(tree)`, an output socket, as emission."""
    tree.nodes.clear()
    emission_node = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(source(tree), emission_node.inputs["Color"])
    tree.links.new(emission_node.outputs["Emission"], tree.nodes.new(output_type).inputs["Surface"])


def add_parametric_light():
    """Add a small area light whose red and green, over its blue, tell which of its points is seen; no bounces."""
    light = add_light("AREA", 1000, (0, 0, 3), size=0.01)

    def parametric(tree):
        split, join = tree.nodes.new("ShaderNodeSeparateXYZ"), tree.nodes.new("ShaderNodeCombineXYZ")
        tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Parametric"], split.inputs[0])
        for axis in ("X", "Y"):
            tree.links.new(split.outputs[axis], join.inputs[axis])
        join.inputs["Z"].default_value = 1.0
        return join.outputs[0]

    emit(light.data.node_tree, "ShaderNodeOutputLight", parametric)
    light.data.cycles.use_multiple_importance_sampling = False
    bpy.context.scene.cycles.max_bounces = 0
    return light


def set_world(color, strength=1.0):
    """Give the scene a world of one colour."""
    world = bpy.data.worlds.new("World")
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (*color, 1)
    background.inputs["Strength"].default_value = strength
    bpy.context.scene.world = world
    return world


def spin(made, degrees_per_frame):
    """Animate a steady turn about the object's z axis over frames 0 to 2; the frame is 1."""
    for frame in (0, 2):
        made.rotation_euler[2] = np.radians(degrees_per_frame * frame)
        made.keyframe_insert("rotation_euler", frame=frame)
    make_linear(made)
    bpy.context.scene.frame_set(1)


def slide(made, start, end):
    """Animate a steady move from `start` at frame 0 to `end` at frame 2; the frame is 1."""
    for frame, location in ((0, start), (2, end)):
        made.location = location
        made.keyframe_insert("location", frame=frame)
    make_linear(made)
    bpy.context.scene.frame_set(1)


def make_linear(made):
    """Make all keyframes of an object linear, also outside their range."""
    bag = made.animation_data.action.layers[0].strips[0].channelbags[0]
    for curve in bag.fcurves:
        curve.extrapolation = "LINEAR"
        for key in curve.keyframe_points:
            key.interpolation = "LINEAR"


def render(folder, engine, samples=1, seed=0):
    """Render the scene and return its passes.

    Returns
    -------
    dict of str to float32 array
        "<layer>.<pass>" -> (height, width, channels), rows from the top.
    """
    scene = bpy.context.scene
    scene.render.engine, scene.spectral_tiles.enabled = "CYCLES", engine == "SPECTRAL_TILES"
    scene.cycles.samples, scene.cycles.seed = samples, seed
    settings = scene.render.image_settings
    settings.media_type = "MULTI_LAYER_IMAGE"
    settings.file_format = "OPEN_EXR_MULTILAYER"
    settings.color_depth = "32"
    path = folder / f"{engine}_{seed}.exr"
    scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)
    passes = read_exr(path)
    path.unlink()
    return passes


def read_exr(path):
    """Passes of a multilayer EXR, whose parts hold a pass each; those of a view have ".<view>" added."""
    oiio = openimageio.load()
    passes = {}
    for part in range(oiio.ImageBuf(str(path)).nsubimages):
        image = oiio.ImageBuf(str(path), part, 0)
        columns = {}
        for column, channel in enumerate(image.spec().channelnames):
            columns.setdefault(channel.rpartition(".")[0], []).append(column)
        pixels = image.get_pixels(oiio.FLOAT)
        view = image.spec().getattribute("view")
        suffix = f".{view}" if view else ""
        passes |= {name.removesuffix(suffix) + suffix: pixels[..., chosen] for name, chosen in columns.items()}
    return passes


def beauty(passes):
    """The first layer's Combined pass, as float64 RGBA in reading order."""
    name = next(name for name in passes if name.endswith("Combined"))
    return passes[name].astype(np.float64)


def stack(folder, engine, seeds, samples=1, choose=beauty):
    """One pass of renders with several seeds, (seeds, height, width, channels)."""
    return np.stack([choose(render(folder, engine, samples, seed)) for seed in seeds])


def assert_same_expectation(ours, native, block=4, quantile=5.0, what="mean"):
    """Assert that two stacks of renders have the same mean, in every block of pixels.

    Blocks of `block` x `block` pixels are averaged first, so that a block's mean over the seeds is close to normal;
    then each block's difference may be at most `quantile` of its own standard errors (plus rounding).  At 5 standard
    errors a false alarm among the 10,000 numbers of a picture has a chance below one in a hundred.
    """

    def blocks(images):
        seeds, height, width, channels = images.shape
        cut = images[:, : height // block * block, : width // block * block]
        return cut.reshape(seeds, height // block, block, width // block, block, channels).mean(axis=(2, 4))

    ours, native = blocks(ours), blocks(native)
    difference = ours.mean(axis=0) - native.mean(axis=0)
    error = np.sqrt(ours.var(axis=0, ddof=1) / len(ours) + native.var(axis=0, ddof=1) / len(native))
    # A block that few samples light has a poorly known variance: use no less than a fifth of the median one.
    error = np.maximum(error, 0.2 * np.median(error, axis=(0, 1)))
    worst = np.abs(difference) / (quantile * error + 1e-5 + 1e-4 * np.abs(native.mean(axis=0)))
    assert worst.max() <= 1.0, f"{what} differs by {worst.max() * quantile:.1f} standard errors at {np.argmax(worst)}"
    return difference


@contextlib.contextmanager
def registered():
    """The add-on, registered for the time of a `with` block."""
    import addon

    addon.register()
    try:
        yield addon
    finally:
        addon.unregister()


class CancelledSoon:
    """A render engine whose user presses Esc after a while."""

    def __init__(self, engine, patience):
        vars(self).update(engine=engine, patience=patience)

    def test_break(self):
        vars(self)["patience"] -= 1
        return self.patience < 0

    def __getattr__(self, name):
        return getattr(self.engine, name)

    def __setattr__(self, name, value):
        setattr(self.engine, name, value)

    def __delattr__(self, name):
        delattr(self.engine, name)
