# SPDX-License-Identifier: GPL-3.0-or-later
"""Small scenes, one for each group of features that a production frame may hold."""

import bpy
import numpy as np

from tests import rendering


def _studio(**camera):
    """A grey floor, a soft light above it, and a camera that looks down on the floor."""
    scene = rendering.empty_scene(32, 32)
    # Few bright paths would need many seeds to average out.
    scene.cycles.sample_clamp_indirect = 1.0
    rendering.add_camera((0, -5, 5), (np.radians(45), 0, 0), **camera)
    rendering.add_plane(8, rendering.diffuse((0.6, 0.6, 0.6)))
    rendering.add_light("AREA", 250, (1, -1, 4), size=2)
    return scene


def _sphere(location, radius, material, subdivisions=3):
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=subdivisions, radius=radius, location=location)
    made = bpy.context.object
    made.data.materials.append(material)
    made.data.shade_smooth()
    return made


def _cube(location, size, material):
    bpy.ops.mesh.primitive_cube_add(size=size, location=location)
    made = bpy.context.object
    made.data.materials.append(material)
    return made


def _principled(**inputs):
    material = bpy.data.materials.new("Principled")
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    for name, value in inputs.items():
        shader.inputs[name.replace("_", " ")].default_value = value
    return material


def _volume(density):
    material = bpy.data.materials.new("Volume")
    tree = material.node_tree
    tree.nodes.clear()
    scatter = tree.nodes.new("ShaderNodeVolumePrincipled")
    scatter.inputs["Density"].default_value = density
    tree.links.new(scatter.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Volume"])
    return material


def subsurface():
    _studio()
    skin = _principled(
        Base_Color=(0.5, 0.3, 0.2, 1), Subsurface_Weight=1, Subsurface_Scale=0.5, Subsurface_Radius=(1, 0.4, 0.2)
    )
    _sphere((0, 0, 0.8), 1.2, skin)


def volume():
    """A cloud before the camera."""
    _studio()
    _cube((0, 0, 1.2), 2, _volume(1.0))
    layer = bpy.context.view_layer.cycles
    layer.use_pass_volume_direct = layer.use_pass_volume_indirect = True


def camera_inside_a_volume():
    _studio()
    _cube((0, -2, 3), 12, _volume(0.05))


def hair():
    _studio()
    curves = bpy.data.hair_curves.new("Hair")
    rng = np.random.default_rng(1)
    roots = np.c_[rng.uniform(-1.5, 1.5, (60, 2)), np.zeros(60)]
    curves.add_curves([3] * 60)
    bends = np.array([(0, 0, 0), (0.1, 0, 0.8), (0.4, 0, 1.4)])
    curves.position_data.foreach_set("vector", (roots[:, None] + bends).astype(np.float32).ravel())
    radius = curves.attributes.new("radius", "FLOAT", "POINT")
    radius.data.foreach_set("value", np.full(180, 0.05, np.float32))
    material = bpy.data.materials.new("Hair")
    tree = material.node_tree
    tree.nodes.clear()
    shader = tree.nodes.new("ShaderNodeBsdfHairPrincipled")
    tree.links.new(shader.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    curves.materials.append(material)
    rendering.add(curves)


def point_cloud():
    _studio()
    cloud = bpy.data.pointclouds.new("Points")
    rng = np.random.default_rng(2)
    cloud.resize(50)
    points = np.c_[rng.uniform(-1.5, 1.5, (50, 2)), rng.uniform(0.2, 1.5, 50)].astype(np.float32)
    cloud.attributes["position"].data.foreach_set("vector", points.ravel())
    cloud.attributes.new("radius", "FLOAT", "POINT").data.foreach_set("value", np.full(50, 0.15, np.float32))
    cloud.materials.append(rendering.diffuse((0.2, 0.5, 0.8)))
    rendering.add(cloud)


def instances():
    """A collection instanced twice, once of it moving."""
    scene = _studio()
    scene.render.use_motion_blur = True
    source = bpy.data.collections.new("Source")
    cube = _cube((0, 0, 0), 1, rendering.diffuse((0.8, 0.3, 0.2)))
    scene.collection.objects.unlink(cube)
    source.objects.link(cube)
    for x in (-1.2, 1.2):
        made = rendering.add(None, (x, 0, 0.6))
        made.instance_type, made.instance_collection = "COLLECTION", source
    rendering.slide(made, (0.6, 0, 0.6), (1.8, 0.5, 0.6))


def displacement():
    """Adaptive subdivision and true displacement, which depend on the size of a pixel."""
    _studio()
    plane = rendering.add_plane(4, rendering.diffuse((0.7, 0.5, 0.3)), (0, 0, 0.3))
    material = plane.data.materials[0]
    material.displacement_method = "DISPLACEMENT"
    tree = material.node_tree
    wave = tree.nodes.new("ShaderNodeTexWave")
    wave.inputs["Scale"].default_value = 1.0
    displace = tree.nodes.new("ShaderNodeDisplacement")
    displace.inputs["Scale"].default_value = 0.6
    tree.links.new(wave.outputs["Factor"], displace.inputs["Height"])
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    tree.links.new(displace.outputs[0], output.inputs["Displacement"])
    modifier = plane.modifiers.new("Subdivision", "SUBSURF")
    modifier.subdivision_type = "SIMPLE"
    modifier.use_adaptive_subdivision = True
    bpy.context.view_layer.use_pass_normal = True


def many_lights():
    """Lamps and mesh lights, chosen by the light tree."""
    scene = rendering.empty_scene(32, 32)
    scene.cycles.use_light_tree = True
    rendering.add_camera((0, -5, 5), (np.radians(45), 0, 0))
    rendering.add_plane(8, rendering.diffuse())
    for x in range(-3, 4):
        for y in range(-2, 3):
            color = (0.5 + x / 8, 0.5 + y / 6, 0.7)
            rendering.add_light("POINT", 8, (x, y, 0.7), color=color, shadow_soft_size=0.1)
    rendering.add_plane(0.4, rendering.emission((1, 0.6, 0.2), 5), (0.5, -0.5, 0.5), (0.5, 0, 0))


def environment():
    """A sky, sampled by its brightness."""
    scene = rendering.empty_scene(32, 32)
    rendering.add_camera((0, -6, 2), (np.radians(80), 0, 0))
    rendering.add_plane(20, rendering.diffuse((0.4, 0.4, 0.4)))
    _sphere((0, 0, 1), 1, rendering.glossy(0.4))
    world = rendering.set_world((1, 1, 1), 0.3)
    tree = world.node_tree
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type = "HOSEK_WILKIE"
    sky.sun_direction = (0.5, -0.5, 0.7)
    tree.links.new(sky.outputs[0], next(n for n in tree.nodes if n.type == "BACKGROUND").inputs["Color"])
    scene.cycles.sample_clamp_indirect = 1.0
    scene.cycles.sample_clamp_direct = 4.0


def shadow_catcher():
    scene = _studio()
    scene.render.film_transparent = True
    next(made for made in scene.objects if made.type == "MESH").is_shadow_catcher = True
    _sphere((0, 0, 1), 0.8, rendering.diffuse((0.8, 0.2, 0.2)))
    bpy.context.view_layer.cycles.use_pass_shadow_catcher = True


def holdout():
    scene = _studio()
    scene.render.film_transparent = True
    _sphere((0, 0, 1), 0.8, rendering.diffuse((0.8, 0.2, 0.2)))
    _cube((1, -1, 0.5), 1, rendering.diffuse()).is_holdout = True


def cryptomatte():
    _studio()
    _sphere((-0.8, 0, 0.8), 0.8, rendering.diffuse((0.8, 0.2, 0.2))).name = "Ball"
    _cube((1, 0, 0.5), 1, rendering.diffuse((0.2, 0.8, 0.2))).name = "Box"
    layer = bpy.context.view_layer
    layer.use_pass_cryptomatte_object = layer.use_pass_cryptomatte_material = layer.use_pass_cryptomatte_asset = True


def output_variables():
    """AOVs: a value and a colour."""
    _studio()
    layer = bpy.context.view_layer
    material = rendering.diffuse((0.3, 0.3, 0.8))
    tree = material.node_tree
    position = tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"]
    for name, kind, socket in (("where", "COLOR", "Color"), ("one", "VALUE", "Value")):
        aov = layer.aovs.add()
        aov.name, aov.type = name, kind
        node = tree.nodes.new("ShaderNodeOutputAOV")
        node.aov_name = name
        node.inputs["Value"].default_value = 1.0
        if kind == "COLOR":
            tree.links.new(position, node.inputs[socket])
    _sphere((0, 0, 1), 1, material)


def light_groups():
    scene = _studio()
    layer = bpy.context.view_layer
    for name in ("key", "rim"):
        layer.lightgroups.add(name=name)
    next(made for made in scene.objects if made.type == "LIGHT").lightgroup = "key"
    rendering.add_light("POINT", 100, (-2, 2, 2), color=(0.3, 0.5, 1)).lightgroup = "rim"
    _sphere((0, 0, 1), 1, rendering.diffuse())


def view_layers():
    """Layers with a material override, a world override, a hidden collection and passes of their own."""
    scene = _studio()
    hidden = bpy.data.collections.new("Hidden")
    scene.collection.children.link(hidden)
    sphere = _sphere((0, 0, 1), 1, rendering.diffuse((0.8, 0.2, 0.2)))
    scene.collection.objects.unlink(sphere)
    hidden.objects.link(sphere)
    clay = scene.view_layers.new("Clay")
    clay.material_override = rendering.diffuse((0.4, 0.4, 0.4))
    clay.use_pass_normal = True
    empty = scene.view_layers.new("Empty")
    empty.layer_collection.children["Hidden"].exclude = True
    empty.world_override = rendering.set_world((0.3, 0.1, 0.1))
    scene.world = None
    empty.use_pass_z = True


def exposed_glass_on_transparent_film():
    scene = _studio()
    scene.render.film_transparent = True
    scene.cycles.film_transparent_glass = True
    scene.cycles.film_exposure = 1.7
    scene.objects["Plane"].scale = (0.3, 0.3, 1)
    _sphere((0, 0, 1), 1, _principled(Transmission_Weight=1.0, Roughness=0.1))


def caustics():
    """Glossy caustics blurred, refractive ones by a shadow caster, light paths cut short."""
    scene = _studio()
    scene.cycles.caustics_reflective = False
    scene.cycles.blur_glossy = 0.5
    scene.cycles.max_bounces = 4
    scene.cycles.sample_clamp_direct = 4.0
    light = next(made for made in scene.objects if made.type == "LIGHT")
    light.data.cycles.is_caustics_light = True
    scene.objects["Plane"].cycles.is_caustics_receiver = True
    ball = _sphere((0, 0, 1), 0.8, _principled(Transmission_Weight=1.0, Roughness=0.0))
    ball.cycles.is_caustics_caster = True


def light_passes():
    scene = _studio()
    rendering.set_world((0.2, 0.3, 0.4))
    scene.objects["Plane"].pass_index = 3
    _sphere((-0.9, 0, 0.8), 0.8, _principled(Roughness=0.3, Metallic=1.0))
    _sphere((0.9, 0, 0.8), 0.8, _principled(Transmission_Weight=1.0, Roughness=0.3))
    _cube((0, -1.5, 0.3), 0.6, rendering.emission((1, 0.4, 0.1)))
    layer = bpy.context.view_layer
    for name in ("diffuse_direct", "diffuse_indirect", "diffuse_color", "glossy_direct", "glossy_indirect",
                 "glossy_color", "transmission_direct", "transmission_indirect", "transmission_color", "emit",
                 "environment", "ambient_occlusion", "z", "mist", "normal", "position", "uv", "object_index",
                 "material_index"):  # fmt: skip
        setattr(layer, f"use_pass_{name}", True)


def motion_and_lens():
    """A moving and a turning thing before a moving camera with an open lens; the Vector pass is empty then."""
    scene = _studio()
    scene.render.use_motion_blur = True
    scene.camera.data.dof.use_dof = True
    scene.camera.data.dof.focus_distance, scene.camera.data.dof.aperture_fstop = 5.0, 0.1
    rendering.slide(scene.camera, (-0.2, -5, 5), (0.2, -5, 5))
    rendering.spin(_cube((0, 0, 0.8), 1.4, rendering.diffuse((0.2, 0.6, 0.3))), 40)
    shape = _sphere((1.5, 1, 0.6), 0.6, rendering.diffuse((0.8, 0.3, 0.3)), 2)
    shape.shape_key_add(name="Basis")
    key = shape.shape_key_add(name="Tall")
    for point in key.data:
        point.co.z *= 2
    for frame in (0, 2):
        key.value = frame / 2
        key.keyframe_insert("value", frame=frame)
    scene.frame_set(1)
    bpy.context.view_layer.use_pass_vector = True


def shading_tricks():
    """Bump, bevel and ambient-occlusion nodes, which look at neighbouring points or cast rays of their own."""
    _studio()
    material = rendering.diffuse()
    tree = material.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_DIFFUSE")
    noise, bump = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeBump")
    bevel, occlusion = tree.nodes.new("ShaderNodeBevel"), tree.nodes.new("ShaderNodeAmbientOcclusion")
    bevel.inputs["Radius"].default_value = 0.2
    tree.links.new(noise.outputs[0], bump.inputs["Height"])
    tree.links.new(bevel.outputs[0], bump.inputs["Normal"])
    tree.links.new(bump.outputs[0], shader.inputs["Normal"])
    tree.links.new(occlusion.outputs["Color"], shader.inputs["Color"])
    _cube((0, 0, 0.8), 1.6, material)


def dome():
    """A fisheye with an open lens that moves."""
    scene = _studio(type="PANO", panorama_type="FISHEYE_EQUIDISTANT", fisheye_fov=2.5)
    scene.render.use_motion_blur = True
    scene.camera.data.dof.use_dof = True
    scene.camera.data.dof.focus_distance, scene.camera.data.dof.aperture_fstop = 4.0, 0.1
    rendering.slide(scene.camera, (-0.3, -5, 5), (0.3, -5, 5))
    _sphere((0, 0, 1), 1, rendering.glossy(0.3))
    rendering.set_world((0.3, 0.4, 0.5))


def stereo_pair():
    scene = _studio()
    scene.render.use_multiview = True
    scene.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    scene.render.image_settings.views_format = "MULTIVIEW"
    scene.camera.data.stereo.interocular_distance = 0.4
    scene.camera.data.dof.use_dof = True
    scene.camera.data.dof.focus_distance, scene.camera.data.dof.aperture_fstop = 5.0, 0.1
    _sphere((0, 0, 1), 1, rendering.glossy(0.3))


SCENES = (
    subsurface, volume, camera_inside_a_volume, hair, point_cloud, instances, displacement, many_lights, environment,
    shadow_catcher, holdout, cryptomatte, output_variables, light_groups, view_layers,
    exposed_glass_on_transparent_film, caustics, light_passes, motion_and_lens, shading_tricks,
    dome, stereo_pair,
)  # fmt: skip
