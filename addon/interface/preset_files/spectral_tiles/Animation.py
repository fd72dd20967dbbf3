import bpy

settings = bpy.context.scene.spectral_tiles

settings.samples = 4
settings.tile = "AUTO"
settings.animated_seed = True
settings.control_variates = True
settings.filter = "AS_CYCLES"
settings.adaptive = "OFF"
settings.driver = "AUTO"
