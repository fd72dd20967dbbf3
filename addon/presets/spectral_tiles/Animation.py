import bpy

settings = bpy.context.scene.spectral_tiles
cycles = bpy.context.scene.cycles

settings.samples = 4
settings.tile = "AUTO"
settings.control_variates = True
settings.filter = "AS_CYCLES"
settings.adaptive = "OFF"
settings.driver = "AUTO"
cycles.use_animated_seed = True
