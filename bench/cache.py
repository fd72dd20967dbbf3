# SPDX-License-Identifier: GPL-3.0-or-later
"""Where references and renders are kept between runs."""

import os
from pathlib import Path

#: Folder of everything that can be made again; ``SPECTRAL_TILES_BENCH_CACHE`` moves it.
CACHE = Path(os.environ.get("SPECTRAL_TILES_BENCH_CACHE") or Path(__file__).parent.parent / ".bench_cache")
