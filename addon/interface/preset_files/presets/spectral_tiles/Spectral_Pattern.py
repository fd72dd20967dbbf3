import bpy

settings = bpy.context.scene.spectral_tiles

settings.method = "GATHER"
settings.sub_frames = 16
settings.distribution = "EVEN"
settings.pattern = "SPECTRAL"
settings.pattern_path = ""
settings.filter = "AS_CYCLES"
settings.filter_width = 2.0
settings.filter_b = 1 / 3
settings.filter_c = 1 / 3
