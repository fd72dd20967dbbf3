# SPDX-License-Identifier: GPL-3.0-or-later
"""The lamps and glowing surfaces that Cycles chooses between are found wherever they hide."""

import time

import bpy
import pytest

from addon.cycles.scene_analysis import scene_use
from tests import rendering


def found():
    return scene_use(bpy.context.evaluated_depsgraph_get())


def collection(*objects):
    """A collection of objects that are not in the scene by themselves."""
    made = bpy.data.collections.new("Kit")
    for obj in objects:
        made.objects.link(obj)
        bpy.context.scene.collection.objects.unlink(obj)
    return made


def add_instance(kit):
    """An empty that shows a collection."""
    empty = rendering.add(None)
    empty.instance_type, empty.instance_collection = "COLLECTION", kit
    return empty


def add_particles(emitter, **settings):
    """Hair of one particle that shows something else."""
    emitter.modifiers.new("Particles", "PARTICLE_SYSTEM")
    particles = emitter.particle_systems[0].settings
    particles.type, particles.count, particles.use_advanced_hair = "HAIR", 3, True
    for name, value in settings.items():
        setattr(particles, name, value)


def grouped(material, depth):
    """The material's tree inside so many groups."""
    for _ in range(depth):
        inner = bpy.data.node_groups.new("Group", "ShaderNodeTree")
        inner.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
        outside = material.node_tree
        for old in outside.nodes:
            if old.bl_idname == "ShaderNodeGroup":
                inner.nodes.new("ShaderNodeGroup").node_tree = old.node_tree
            elif old.bl_idname != "ShaderNodeOutputMaterial":
                new = inner.nodes.new(old.bl_idname)
                for target, source in zip(new.inputs, old.inputs, strict=True):
                    if hasattr(source, "default_value"):
                        target.default_value = source.default_value
        outside.nodes.clear()
        outside.nodes.new("ShaderNodeGroup").node_tree = inner
    return material


@pytest.fixture(autouse=True)
def scene():
    made = rendering.empty_scene()
    rendering.add_camera()
    return made


@pytest.mark.parametrize(
    ("kind", "size"), [("POINT", "shadow_soft_size"), ("SPOT", "shadow_soft_size"), ("SUN", "angle")]
)
def test_a_single_lamp_without_size_leaves_nothing_to_chance(kind, size):
    lamp = rendering.add_light(kind, 1.0, (0, 0, 3), **{size: 0.0})
    assert found().lights == 0
    setattr(lamp.data, size, 0.1)
    assert found().lights == 1
    setattr(lamp.data, size, 0.0)
    rendering.add_light(kind, 1.0, (1, 0, 3), **{size: 0.0})
    assert found().lights == 2


@pytest.mark.parametrize(("sampled", "lights"), [(True, 2), (False, 0)])
def test_emission_that_cycles_does_not_sample_is_no_light(sampled, lights):
    material, world = rendering.emission(), rendering.set_world((1, 1, 1))
    rendering.add_plane(1, material)
    if not sampled:
        material.cycles.emission_sampling = world.cycles.sampling_method = "NONE"
    assert found().lights == lights


def test_lamps_in_a_collection_instance():
    lamps = [rendering.add_light("AREA", 1.0, (x, 0, 3)) for x in range(4)]
    kit = collection(*lamps)
    assert found().lights == 0
    add_instance(kit)
    assert found().lights == 4
    add_instance(kit)
    assert found().lights == 8
    rendering.add_light("POINT", 1.0, (0, 0, 3))
    assert found().lights == 9


def test_lamps_of_particles():
    lamp = rendering.add_light("POINT", 1.0, (0, 0, 3))
    add_particles(rendering.add_plane(1), render_type="OBJECT", instance_object=lamp)
    assert found().lights == 4


def test_lamps_of_geometry_nodes():
    lamp = rendering.add_light("POINT", 1.0, (0, 0, 3))
    collection(lamp)
    group = bpy.data.node_groups.new("Lamps", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    nodes, link = group.nodes, group.links.new
    points, on_points = nodes.new("GeometryNodePoints"), nodes.new("GeometryNodeInstanceOnPoints")
    info = nodes.new("GeometryNodeObjectInfo")
    points.inputs["Count"].default_value = 5
    info.inputs["Object"].default_value, info.inputs["As Instance"].default_value = lamp, True
    link(points.outputs[0], on_points.inputs["Points"])
    link(info.outputs["Geometry"], on_points.inputs["Instance"])
    link(on_points.outputs[0], nodes.new("NodeGroupOutput").inputs[0])
    rendering.add_plane(1).modifiers.new("Lamps", "NODES").node_group = group
    assert found().lights == 5


def test_a_glowing_mesh_in_a_collection_instance():
    add_instance(collection(rendering.add_plane(1, rendering.emission())))
    use = found()
    assert (use.lights, use.glow) == (1, True)


def test_a_portal_is_no_lamp():
    lamp = rendering.add_light("AREA", 1.0, (0, 0, 3))
    lamp.data.cycles.is_portal = True
    assert found().lights == 0


@pytest.mark.parametrize("depth", [0, 1, 2])
@pytest.mark.parametrize(("strength", "lights"), [(1.0, 2), (0.0, 0)])
def test_emission_in_groups(depth, strength, lights):
    """Two materials share the innermost group."""
    material = grouped(rendering.emission(strength=strength), depth)
    rendering.add_plane(1, material)
    rendering.add_plane(1, material.copy())
    assert found().lights == lights


@pytest.mark.parametrize("texture", ["ShaderNodeTexEnvironment", "ShaderNodeTexSky"])
def test_a_world_of_an_image_or_sky(texture):
    world = rendering.set_world((0, 0, 0))
    assert not found().glow
    tree = world.node_tree
    background = next(node for node in tree.nodes if node.type == "BACKGROUND")
    tree.links.new(tree.nodes.new(texture).outputs["Color"], background.inputs["Color"])
    use = found()
    assert (use.lights, use.glow) == (1, True)


def test_a_muted_node_does_nothing():
    material = rendering.diffuse()
    material.node_tree.nodes.new("ShaderNodeEmission").mute = True
    rendering.add_plane(1, material)
    use = found()
    assert not use.glow


def test_thousands_of_objects_take_milliseconds():
    """Three thousand planes and as many instances of a thousand lamps among them."""
    for _ in range(3000):
        rendering.add_plane(1, bpy.data.materials.get("ShaderNodeBsdfDiffuse") or rendering.diffuse())
    kit = collection(*(rendering.add_light("POINT", 1.0, (0, 0, 3)) for _ in range(100)))
    for _ in range(100):
        add_instance(kit)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    start = time.process_time()
    use = scene_use(depsgraph)
    assert time.process_time() - start < 0.1
    assert use.lights > 1


@pytest.mark.parametrize("kind", ["material", "world"])
def test_volumes_are_found(kind):
    rendering.empty_scene()
    rendering.add_plane(2, rendering.diffuse())
    rendering.set_world((0.1, 0.1, 0.1))
    assert not found().volume
    owner = bpy.context.scene.world if kind == "world" else bpy.data.objects["Plane"].data.materials[0]
    tree = owner.node_tree
    output = next(node for node in tree.nodes if "Volume" in node.inputs)
    tree.links.new(tree.nodes.new("ShaderNodeVolumeScatter").outputs[0], output.inputs["Volume"])
    assert found().volume
