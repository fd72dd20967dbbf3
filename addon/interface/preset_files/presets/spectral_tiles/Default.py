import bpy

settings = bpy.context.scene.spectral_tiles

settings.method = "AUTO"
settings.sub_frames = 16
settings.distribution = "BY_NOISE"
settings.pattern = "AUTO"
settings.pattern_path = ""
settings.filter = "AS_CYCLES"
settings.filter_width = 2.0
settings.filter_b = 1 / 3
settings.filter_c = 1 / 3
