# SPDX-License-Identifier: GPL-3.0-or-later
"""What a frame uses: which of Cycles' random numbers have something to decide in it, shadow catchers and volumes."""

from dataclasses import dataclass
from typing import NamedTuple

import bpy

from . import shader_nodes

# Instances that are looked through for lamps, some milliseconds' worth.
_MOST_INSTANCES = 5000


@dataclass(frozen=True)
class SceneUse:
    """What a frame uses.

    Attributes
    ----------
    motion_blur, lens : bool
        Whether rays differ in time, in where they pass the lens.
    lights : int
        Emitters that Cycles chooses between (`contents`).
    bounces : bool
        Whether light that was scattered more than once is rendered.
    glow : bool
        Whether any emitter is not a lamp, so that scattered rays find much of the light.
    blades : int
        Of the lens; 0 if it is round, or a pinhole.
    shadow_catcher : bool
        Whether any object only shows the shadows that fall on it.
    volume : bool
        Whether any material, or the world, has a volume.
    """

    motion_blur: bool
    lens: bool
    lights: int
    bounces: bool
    glow: bool
    blades: int = 0
    shadow_catcher: bool = False
    volume: bool = False

    @property
    def dims(self):
        """Tile dimensions that have something to decide, in the tile format's order."""
        dims = []
        if self.motion_blur:
            dims.append("t")
        if self.lens:
            dims += ["lens.u", "lens.v"]
        if self.lights:
            dims += ["light.u", "light.v"]
        if self.lights > 1:
            dims.append("light.pick")
        if self.bounces:
            dims += ["bsdf.u", "bsdf.v"]
        return tuple(dims)


class Contents(NamedTuple):
    """What objects, materials and the world do.

    Attributes
    ----------
    lights : int
        Number of emitters that Cycles chooses between; 0 for a single lamp without size, for nothing about it is left
        to chance.
    glow : bool
        Whether any of them is not a lamp.
    shadow_catcher : bool
        Whether any object is one.
    volume : bool
        Whether there is one.
    """

    lights: int
    glow: bool
    shadow_catcher: bool
    volume: bool


def contents(depsgraph):
    """Look through a scene that was evaluated, without touching its geometry; returns `Contents`."""
    # There are many data, but few types, and asking Blender's types what they are takes a while.
    by_type = {}
    for data in depsgraph.ids:
        by_type.setdefault(type(data), []).append(data)

    def all_of(kind):
        return [data for found, datas in by_type.items() if issubclass(found, kind) for data in datas]

    lamps = _lamps(depsgraph, all_of(bpy.types.Light))
    glowing, groups = 0, {}
    shaded = all_of(bpy.types.Material) + all_of(bpy.types.World)
    for data in shaded:
        plain = data.node_tree is None and isinstance(data, bpy.types.World) and any(data.color)
        glowing += (plain or shader_nodes.emit(data.node_tree, groups)) and _is_sampled(data)
    only_a_point = len(lamps) == 1 and not glowing and _is_point(lamps[0])
    catches = any(obj.is_shadow_catcher and obj.type != "LIGHT" for obj in all_of(bpy.types.Object))
    has_volume = any(shader_nodes.have_volume(data.node_tree) for data in shaded)
    return Contents(0 if only_a_point else len(lamps) + glowing, glowing > 0, catches, has_volume)


def scene_use(depsgraph, found=None):
    """The `SceneUse` of a frame, found without touching its geometry.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
        Evaluated for the frame.
    found : Contents, optional
        What `contents` found; it is asked by default.
    """
    scene, layer = depsgraph.scene, depsgraph.view_layer
    camera = scene.camera
    cycles = scene.cycles
    found = found or contents(depsgraph)
    lens = camera is not None and camera.type == "CAMERA" and camera.data.dof.use_dof
    return SceneUse(
        motion_blur=scene.render.use_motion_blur and layer.use_motion_blur,
        lens=lens,
        lights=found.lights,
        bounces=cycles.max_bounces > 0
        and any((cycles.diffuse_bounces, cycles.glossy_bounces, cycles.transmission_bounces, cycles.volume_bounces)),
        glow=found.glow,
        blades=camera.data.dof.aperture_blades if lens and camera.data.dof.aperture_blades >= 3 else 0,
        shadow_catcher=found.shadow_catcher,
        volume=found.volume,
    )


def _lamps(depsgraph, datas):
    """Data of the lamps that shine, once for each of their instances, given all data of lamps there are."""
    found = []
    for number, instance in enumerate(depsgraph.object_instances if datas else ()):
        if number == _MOST_INSTANCES:
            # Those that are not shown by themselves may be anywhere among the others, and more than once.
            found = [obj.data for obj in depsgraph.objects if obj.type == "LIGHT"]
            found += 2 * list(set(datas) - set(found))
            break
        obj = instance.object
        if obj.type == "LIGHT":
            found.append(obj.data)
    return [data for data in found if not data.cycles.is_portal]


def _is_point(lamp):
    """Whether all of a lamp's light comes from one point or direction."""
    return lamp.type != "AREA" and (lamp.angle if lamp.type == "SUN" else lamp.shadow_soft_size) == 0.0


def _is_sampled(data):
    """Whether Cycles chooses a material or world as a light if it emits."""
    if isinstance(data, bpy.types.World):
        return data.cycles.sampling_method != "NONE"
    return data.cycles.emission_sampling != "NONE"
