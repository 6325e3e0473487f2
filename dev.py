"""The recipe for every system: `python dev.py demo`, `test`, `exam`, `release` or `ready`; make calls it too.

It needs Python 3.11 or newer and nothing else; on Windows, `py dev.py demo`.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parent
VENV = ROOT / ".venv"
READY = VENV / "ready"
_MADE_OF = ("requirements.lock", "pyproject.toml")
_UV = "uv==0.13.8"
_LEAST = (3, 11)
_TRIED_WITH = ("pytest>=8", "hypothesis>=6", "pyuff>=2.5.8")
_TRIED = ("tests/core", "tests/test_study.py", "tests/reports/test_write.py", "tests/fitting/optimizers")
"""What `lowest` installs beside the package, and the tests that it runs."""
_EXAMPLE = "configs/arm_hammer_test.yaml"


def program(name: str, environment: Path = VENV, windows: bool = os.name == "nt") -> Path:
    """Where a program of an environment is."""
    return environment / ("Scripts" if windows else "bin") / (f"{name}.exe" if windows else name)


def environment() -> dict[str, str]:
    """One thread a process; and where Python is told not to write bytecode beside sources, another place for
    it: each of the hundreds of processes that the tests start would compile all libraries anew.
    """
    found = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", **os.environ}
    if found.pop("PYTHONDONTWRITEBYTECODE", ""):
        found["PYTHONPYCACHEPREFIX"] = str(VENV / "bytecode")
    return found


def ended(name: str, *words: str, out: int | None = None) -> int:
    """The exit code of a program of the environment, run in this folder; out: where what it prints goes."""
    command = [str(program(name)), *words]
    return subprocess.run(command, check=False, cwd=ROOT, env=environment(), stdout=out).returncode


def run(name: str, *words: str) -> None:
    """Run a program of the environment; stop with its exit code where it fails."""
    if code := ended(name, *words):
        sys.exit(code)


def _is_newer(one: Path, other: Path) -> bool:
    return one.stat().st_mtime >= other.stat().st_mtime


def ready() -> None:
    """An environment with the locked dependencies and this package, made anew where either has changed."""
    if READY.exists() and all(_is_newer(READY, ROOT / name) for name in _MADE_OF):
        return
    if not program("python").exists():
        subprocess.run([sys.executable, "-m", "venv", str(VENV)], check=True)
    run("python", "-m", "pip", "install", "-q", "--no-compile", "--disable-pip-version-check", _UV)
    install = ("-m", "uv", "pip", "install", "-q")
    run("python", *install, "--require-hashes", "-r", "requirements.lock")
    run("python", *install, "--no-deps", "--no-build-isolation", "-e", ".")
    READY.touch()


def demo() -> None:
    """Check and fit a hammer test of a six-axis arm."""
    ready()
    run("identify", "check", _EXAMPLE)
    run("identify", "fit", _EXAMPLE)
    print("Open reports/arm_hammer_test.html in a browser.")


def test() -> None:
    """Style, types and tests; types are checked beside the tests, and told after them."""
    ready()
    run("ruff", "format", "--check", ".")
    run("ruff", "check", ".")
    types = [str(program("mypy")), "--num-workers", "1"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
    with subprocess.Popen(types, cwd=ROOT, env=environment(), **pipes) as checked:
        # Compiles all tests and libraries once, which takes half a minute, rather than in each process.
        ended("pytest", "--collect-only", out=subprocess.DEVNULL)
        code = ended("pytest", "-n", "logical", "--dist", "loadfile", "--no-loadscope-reorder")
        print(checked.communicate()[0].decode(), end="")
    sys.exit(code or checked.returncode)


def exam() -> None:
    """The long tests that `test` leaves out; what they found is in tests/benchmarks/results/exam.json."""
    ready()
    run("python", "-m", "tests.benchmarks.exam", "-n", "logical")


def release() -> None:
    """Build wheel and sdist into dist/, and fit the example with each, installed in a bare environment."""
    ready()
    shutil.rmtree(ROOT / "dist", ignore_errors=True)
    run("python", "-m", "hatchling", "build", "-d", "dist")
    for built in sorted((ROOT / "dist").iterdir()):
        with tempfile.TemporaryDirectory() as folder:
            bare = Path(folder) / "bare"
            run("python", "-m", "uv", "venv", "-q", "--seed", str(bare))
            python = str(program("python", bare))
            run("python", "-m", "uv", "pip", "install", "-q", "--python", python, str(built))
            fit = [str(program("identify", bare)), "fit", str(ROOT / _EXAMPLE), "--out", "arm.h5"]
            done = subprocess.run(fit, check=False, cwd=folder)
            if done.returncode or not (Path(folder) / "arm.pdf").exists():
                sys.exit(f"{built.name}: the example cannot be fitted with it")
        print(f"{built.name}: installed in a bare environment, it fits the example.")


def lowest() -> None:
    """Try the lowest versions that pyproject.toml allows, in a bare environment, by a part of the tests."""
    ready()
    with tempfile.TemporaryDirectory() as folder:
        bare = Path(folder) / "bare"
        run("python", "-m", "uv", "venv", "-q", str(bare))
        python = str(program("python", bare))
        install = ("-m", "uv", "pip", "install", "-q", "--python", python, "--resolution", "lowest-direct")
        run("python", *install, ".", *_TRIED_WITH)
        done = subprocess.run(
            [python, "-m", "pytest", "-W", "default", *_TRIED], check=False, cwd=ROOT, env=environment()
        )
    if done.returncode:
        sys.exit("the lowest versions do not work: raise the bound of what fails in pyproject.toml")


RECIPES = {"ready": ready, "demo": demo, "test": test, "exam": exam, "release": release, "lowest": lowest}


def main(words: list[str]) -> None:
    """Do the one that is asked for."""
    if sys.version_info < _LEAST:
        sys.exit(f"Python {sys.version.split()[0]}: identify needs 3.11 or newer; run this with a newer one.")
    if len(words) != 1 or words[0] not in RECIPES:
        told = "\n".join(f"  {name:6s} {recipe.__doc__}" for name, recipe in RECIPES.items())
        sys.exit(f"usage: python dev.py {' | '.join(RECIPES)}\n{told}")
    RECIPES[words[0]]()


if __name__ == "__main__":
    main(sys.argv[1:])
