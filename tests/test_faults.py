"""The list of faults stands for the code as it is, and the run tells a fault that is noticed from one that is
not.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.benchmarks import faults
from tests.benchmarks.faults import Fault, read_faults, tried

ROOT = Path(__file__).parents[1]
LAW = "def twice(x):\n    return 2 * x\n"
TEST = "from law import twice\n\n\ndef test_twice():\n    assert twice({}) == {}\n"


@pytest.mark.parametrize("fault", read_faults(), ids=lambda fault: fault.name)
def test_every_fault_stands_once_and_has_tests(fault: Fault) -> None:
    assert fault.found(ROOT) == 1, f"change the text of {fault.name!r} in faults.yaml with {fault.file}"
    for test in fault.tests:
        path, _, name = test.partition("::")
        assert f"def {name}" in (ROOT / path).read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("argument", "verdict"), [(3, "killed"), (0, "survived")], ids=["a test that can fail", "one that cannot"]
)
def test_verdicts(argument: int, verdict: str, tmp_path: Path) -> None:
    """Twice nothing is nothing whatever the factor: a test of that alone does not notice the fault."""
    (tmp_path / "law.py").write_text(LAW)
    (tmp_path / "test_law.py").write_text(TEST.format(argument, 2 * argument))
    fault = Fault("factor", "law.py", "2 * x", "3 * x", ("test_law.py",))
    assert tried(tmp_path, fault, 0).verdict == verdict
    assert (tmp_path / "law.py").read_text() == LAW, "the file is as it was"


def test_faults_that_cannot_be_tried(tmp_path: Path) -> None:
    (tmp_path / "law.py").write_text(LAW)
    gone = Fault("gone", "law.py", "2*x", "3*x", ("test_law.py",))
    assert tried(tmp_path, gone, 1).verdict == "stale"
    lost = Fault("lost", "law.py", "2 * x", "3 * x", ("test_other.py",))
    assert tried(tmp_path, lost, 2).verdict == "broken"


def test_a_fault_that_is_none_is_refused(tmp_path: Path) -> None:
    row = "- {name: same, file: law.py, text: a, fault: a, tests: [test_law.py]}\n"
    (tmp_path / "faults.yaml").write_text(row)
    with pytest.raises(ValueError, match="same changes nothing"):
        read_faults(tmp_path / "faults.yaml")
    (tmp_path / "faults.yaml").write_text(2 * row.replace("fault: a", "fault: b"))
    with pytest.raises(ValueError, match="two faults"):
        faults.read_faults(tmp_path / "faults.yaml")
