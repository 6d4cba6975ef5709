"""The program `lanternfish` of the package."""

import os
import pathlib
import stat
import subprocess
import sys
import tempfile

import pytest

import lanternfish
from lanternfish import _driver

OWN, PROGRAM = [sys.executable, "-m", "lanternfish"], os.environ.get("LANTERNFISH_PROGRAM")


# What pip installs beside a package.
SCRIPT = pathlib.Path(lanternfish.__file__).parents[1] / "bin/lanternfish"


def run(program, *words, **options):
    return subprocess.run([*program, *words], capture_output=True, text=True, timeout=120, **options)


@pytest.mark.skipif(not PROGRAM, reason="LANTERNFISH_PROGRAM names no program")
@pytest.mark.parametrize("words", [
    ["--version"], ["render", "--help"], ["render", "demo:nothing"], ["render", "--sise", "3"], ["info", "demo:cornell"],
    ["compare", "a.png", "a.png"],
])
def test_it_says_what_cargos_says(tmp_path, words):
    ours, cargos = (run(program, *words, cwd=tmp_path) for program in (OWN, [PROGRAM]))
    assert (ours.returncode, ours.stdout, ours.stderr) == (cargos.returncode, cargos.stdout, cargos.stderr)
    assert ours.stdout + ours.stderr


@pytest.mark.skipif(not PROGRAM, reason="LANTERNFISH_PROGRAM names no program")
def test_it_writes_the_bytes_of_cargos(tmp_path):
    for program, name in ((OWN, "ours"), ([PROGRAM], "cargos")):
        words = ["render", "demo:cornell", "--size", "48x32", "--quality", "draft", "-o", f"{name}.png"]
        assert run(program, *words, cwd=tmp_path).returncode == 0
    assert (tmp_path / "ours.png").read_bytes() == (tmp_path / "cargos.png").read_bytes()


@pytest.mark.skipif(not SCRIPT.exists(), reason="the package was not installed into a folder")
def test_the_wheel_brings_the_program():
    script, module = (run(program, "--version") for program in ([sys.executable, SCRIPT], OWN))
    assert (script.returncode, script.stdout) == (0, module.stdout)


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="folders have no owners")
def test_compiled_shaders_of_others_are_not_run(tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(os, "access", lambda *_: False)
    monkeypatch.delenv("MESA_SHADER_CACHE_DIR", raising=False)

    def folder() -> str:
        return _driver._shader_cache()["MESA_SHADER_CACHE_DIR"]

    first = folder()
    assert first == folder() and stat.S_IMODE(os.stat(first).st_mode) == 0o700
    os.chmod(first, 0o777)
    assert os.path.dirname(folder()) == str(tmp_path) and folder() != first
    os.rmdir(first)
    os.symlink("/usr", first)
    assert folder() not in (first, "/usr")
