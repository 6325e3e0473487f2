"""`identify export` as a user meets it, and the same from Python."""

from __future__ import annotations

from pathlib import Path

import identify
from tests.export.conftest import Result
from tests.programs import ran


def test_the_command_says_what_it_wrote_and_what_it_could_not(result: Result, tmp_path: Path) -> None:
    source = str(result("lossy"))
    done = ran("export", source, "--to", "mat", "--out", "arm.mat", "--error", "0.2", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "note: hysteretic damping is made viscous" in done.stdout and "wrote arm.mat" in done.stdout
    again = ran("export", source, "--to", "mat", "--out", "arm.mat", cwd=tmp_path)
    assert again.returncode == 2 and "arm.mat: the file exists" in again.stderr
    quiet = ran("export", source, "--to", "mat", "--out", "other.mat", "--quiet", cwd=tmp_path)
    assert (quiet.returncode, quiet.stdout) == (0, "")
    refused = ran("export", source, "--to", "fmu", cwd=tmp_path)
    assert refused.returncode == 2 and "compiled for each system" in refused.stderr
    here = ran("export", source, "--to", "npz", "--out", source, cwd=tmp_path)
    assert here.returncode == 2 and "the result itself" in here.stderr


def test_from_python(result: Result, tmp_path: Path) -> None:
    model = identify.read_result(result("plain"))
    written = identify.export_model(model, "npz", posture=["posture1"], out=tmp_path / "arm.npz")
    assert written == [tmp_path / "arm.npz"] and written[0].exists()
