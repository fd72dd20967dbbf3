# SPDX-License-Identifier: GPL-3.0-or-later
"""The bench scenes: each a module with ``build()``, of a kind artists make, made of code alone.

None is tuned to a sampler: they vary in what moves, how many and what kind of emitters there are, whether the lens is
open and how much light is indirect.
"""

from demo_blend import DEMOS

#: Builder module of each scene, by the name `python -m bench` knows it by.
BUILDERS = {
    "wheels": "demo_blend.spinning_wheels",
    "cubes": "bench.scenes.falling_cubes",
    "room": "bench.scenes.room",
    "sun_sky": "bench.scenes.sun_and_sky",
    "metal": "bench.scenes.glossy_metal",
    "fur": "bench.scenes.rolling_fur",
    "bokeh": "bench.scenes.bokeh_lights",
    "neon": "bench.scenes.neon_sign",
    "still_life": "bench.scenes.still_life",
    "hazy_room": "bench.scenes.hazy_room",
    "heavy": "bench.scenes.heavy",
    "plain_sun": "bench.scenes.plain_sun",
    "meadow": "bench.scenes.meadow",
    "glassware": "bench.scenes.glassware",
    "candles": "bench.scenes.candles",
    "misty_wood": "bench.scenes.misty_wood",
    "night_market": "bench.scenes.night_market",
    "creature": "bench.scenes.shaggy_creature",
    **{name: f"demo_blend.{name}" for name in DEMOS if name != "spinning_wheels"},
}

#: Scenes as a production has them: heavy in geometry and shading, so that a sample costs 5 to 50 microseconds.
PRODUCTION = ("meadow", "glassware", "candles", "misty_wood", "night_market", "creature")

#: Scenes that are there for their wall time only, and those of the quality table.
COSTLY = ("hazy_room", "heavy", "plain_sun")
QUALITY = tuple(name for name in BUILDERS if name not in (*COSTLY, *PRODUCTION, *DEMOS))
