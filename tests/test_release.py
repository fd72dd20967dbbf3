# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension's archive builds, installs into a fresh Blender profile and renders; its versions and notes agree."""

import shutil
import subprocess
import sys
import zipfile

import pytest

pytest.importorskip("bpy")

from bench import release
from bench.archive import ROOT, build


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    return build(tmp_path_factory.mktemp("dist"))


def test_archive_holds_only_what_runs(archive):
    names = zipfile.ZipFile(archive).namelist()
    tops = {name.split("/")[0] for name in names}
    assert tops == {"__init__.py", "blender_manifest.toml", "LICENSE", "addon", "generator"}
    assert not [name for name in names if name.endswith((".md", ".jpg", ".png", ".blend", ".pyc"))]
    assert archive.stat().st_size < 10e6
    assert archive.name == f"spectral_tiles-{release.agreed_version()}.zip"


def test_archive_is_the_same_from_another_checkout(archive, tmp_path, monkeypatch):
    """Files of another age, written in another order, with other permissions."""
    checkout = tmp_path / "checkout"
    folders = shutil.ignore_patterns("__pycache__", ".*", "docs", "tests", "bench", "demo_blend", "dist", "out")
    shutil.copytree(ROOT, checkout, ignore=folders, copy_function=shutil.copyfile)
    (checkout / "LICENSE").chmod(0o600)
    monkeypatch.setattr("bench.archive.ROOT", checkout)
    assert build(tmp_path / "dist").read_bytes() == archive.read_bytes()


def test_installed_archive_renders(archive):
    release.try_archive(archive)


def test_change_log_tells_of_this_version():
    assert release.changes_of(release.agreed_version()).startswith("- ")
    with pytest.raises(ValueError, match=r"CHANGELOG.md says nothing of 9\.9\.9"):
        release.changes_of("9.9.9")


def test_versions_that_differ_are_named(tmp_path, monkeypatch):
    for name in ("blender_manifest.toml", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    manifest = tmp_path / "blender_manifest.toml"
    manifest.write_text(manifest.read_text().replace(f'version = "{release.agreed_version()}"', 'version = "9.9.9"'))
    monkeypatch.setattr(release, "ROOT", tmp_path)
    with pytest.raises(ValueError, match=r"blender_manifest.toml has 9\.9\.9"):
        release.agreed_version()


def test_older_blender_is_refused_by_name():
    older = "import sys, types; app = types.SimpleNamespace(version=(4, 5, 0), version_string='4.5.0 LTS')"
    code = f"{older}; sys.modules['bpy'] = types.SimpleNamespace(app=app); import addon"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].endswith("Spectral Tiles needs Blender 5.2 LTS or newer, this is 4.5.0 LTS")
