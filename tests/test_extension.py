# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's archive builds, installs into a fresh Blender profile and renders."""

import os
import shutil
import subprocess
import sys
import zipfile

import pytest

pytest.importorskip("bpy")

from bench.archive import ROOT, build

INSTALL_AND_RENDER = """
import sys
import bpy

archive, picture = sys.argv[1:]
bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
scene = bpy.context.scene
scene.render.engine = "SPECTRAL_TILES"
scene.render.resolution_x = scene.render.resolution_y = 32
scene.spectral_tiles.samples = 2
scene.render.filepath = picture
bpy.ops.render.render(write_still=True)

from bl_ext.user_default.spectral_tiles.addon import command
assert command.run(["tile", "--help"]) == command.DONE
"""


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    return build(tmp_path_factory.mktemp("dist"))


def test_archive_holds_only_what_runs(archive):
    names = zipfile.ZipFile(archive).namelist()
    tops = {name.split("/")[0] for name in names}
    assert tops == {"__init__.py", "blender_manifest.toml", "LICENSE", "addon", "generator"}
    assert not [name for name in names if name.endswith((".md", ".jpg", ".png", ".blend", ".pyc"))]
    assert archive.stat().st_size < 10e6


def test_archive_is_the_same_from_another_checkout(archive, tmp_path, monkeypatch):
    """Files of another age, written in another order, with other permissions."""
    checkout = tmp_path / "checkout"
    folders = shutil.ignore_patterns("__pycache__", ".*", "docs", "tests", "bench", "demo_blend", "dist", "out")
    shutil.copytree(ROOT, checkout, ignore=folders, copy_function=shutil.copyfile)
    (checkout / "LICENSE").chmod(0o600)
    monkeypatch.setattr("bench.archive.ROOT", checkout)
    assert build(tmp_path / "dist").read_bytes() == archive.read_bytes()


def test_installed_archive_renders(archive, tmp_path):
    script, picture = tmp_path / "script.py", tmp_path / "picture.png"
    script.write_text(INSTALL_AND_RENDER)
    environment = os.environ | {"BLENDER_USER_RESOURCES": str(tmp_path / "profile")}
    result = subprocess.run(
        [sys.executable, script, archive, picture], env=environment, cwd=tmp_path, capture_output=True, text=True
    )
    assert picture.exists(), result.stdout + result.stderr
    assert picture.stat().st_size > 500
