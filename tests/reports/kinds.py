"""One case a kind of report: what the tests that hold for every kind run over.  A new kind of report is one
more row here.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from unittest.mock import patch

from identify.reports.kinds import report_of
from identify.reports.kit.document import Document, document
from identify.reports.kit.page import page
from identify.reports.kit.report import Report
from identify.reports.write import write_reports
from identify.results import file as result_file
from tests.reports.deflection_sample import deflection_result
from tests.reports.discovery_sample import discovery_result, null_result
from tests.reports.excite_sample import excite_result
from tests.reports.explain_sample import explain_result
from tests.reports.joints_sample import joints_result
from tests.reports.modes_sample import modes_result
from tests.reports.motion_sample import motion_result
from tests.reports.pdf_text import lines
from tests.reports.plan_sample import plan_result
from tests.reports.posture_sample import batch_result, map_result
from tests.reports.sample import frf_result, modal_result
from tests.reports.stability_sample import stability_result


@dataclass(frozen=True)
class Case:
    """kind: of the report; make: the results whose files give it; kept: numbers that must be those of the
    (first) file, as (beginning of a table's title, heading of a column, dataset or dataset:column, factor),
    where a fit that failed has no row; shapes, frfs: whether it has moving shapes, a channel picker.
    """

    name: str
    kind: str
    make: Callable[[], list[Any]]
    kept: tuple[tuple[str, str, str, float], ...]
    shapes: bool = True
    frfs: bool = True


def _two_runs() -> list[Any]:
    one = frf_result(60, 4)
    table = dataclasses.replace(one.parameters, value=one.parameters.value * 1.05)
    other = dataclasses.replace(
        one,
        parameters=table,
        gap=2.5,
        cost_kind="frf-area",
        effects=(*one.effects, "compliance of the base (rx)"),
    )
    return [one, other]


_PARAMETERS = (
    ("Parameters", "Fitted", "parameters/value", 1.0),
    ("Parameters", "Start", "parameters/initial", 1.0),
)

_MOTION = (
    *_PARAMETERS,
    ("Effects that may be missing", "Gap", "trials/gap", 1.0),
    ("Effects that may be missing", "Gap, validation", "trials/gap_validation", 1.0),
    ("RMS difference of motor torque", "Whole record", "records/a/comparisons/motor_torque/rms:0", 1.0),
)
_BATCH = (
    ("Does it depend on posture?", "Mean", "dependence/mean", 1.0),
    ("Does it depend on posture?", "Fitted together", "parameters/joint_value", 1.0),
    ("Does it depend on posture?", "Chi-square", "dependence/chi_square", 1.0),
    ("Mean and scatter over all fits", "Mean", "population/mean", 1.0),
    ("Each fit combined with the others", "joint1.rz.damping", "population/value:1", 1.0),
    ("Parameters by posture", "joint1.rz.stiffness", "parameters/value:0", 1.0),
    ("Parameters by posture", "joint1.rz.damping", "parameters/value:1", 1.0),
)
_EXPLAINED = (
    ("Motor torque: residuals", "Held out, before", "targets/torque/rms_judge_start", 1.0),
    ("Motor torque: residuals", "Held out, after", "targets/torque/rms_judge", 1.0),
    ("Motor torque: effects", "Evidence", "targets/torque/effects/evidence", 1.0),
    ("Motor torque: values", "Fitted", "targets/torque/values/value", 1.0),
    ("Motor torque: values", "Held-out record alone", "targets/torque/values/other", 1.0),
)
_JOINTS = (
    ("joint1 stiffness", "Identified", "curves/joint1%20stiffness/values/value", 1.0),
    ("joint1 friction", "Identified", "curves/joint1%20friction/values/value", 1.0),
)
_MAP = (
    ("Postures", "Joint 1", "rows/posture_deg:0", 1.0),
    ("Postures", "Tool z", "rows/tool_m:2", 1.0),
    ("Postures", "Mode 2", "rows/frequency_hz:1", 1.0),
    ("What the map does not know", "Log odds", "learnt/processes/log_odds", 1.0),
)
_STABILITY = (
    ("Depth limits", "Limit", "limits/depth_m", 1e3),
    ("Depth limits", "Chatter", "limits/chatter_hz", 1.0),
    ("The same limit", "Semi-discretisation", "checks/semi_discretization", 1e3),
    ("Feed directions", "Least limit", "feed_depth_m", 1e3),
    ("Modes at this posture", "Frequency", "mode_hz", 1.0),
)
_DEFLECTION = (
    ("Deflections", "Moves x", "rows/deflection_m:0", 1e6),
    ("Deflections", "Force z", "rows/force_n:2", 1.0),
    ("The compensated path", "Send y", "rows/target_m:1", 1e3),
)
_PLAN = (
    ("Promised intervals", "Value", "promised/value", 1.0),
    ("Promised intervals", "± promised", "promised/promised", 100.0),
    ("Postures", "joint2", "posture_deg:1", 1.0),
)
_EXCITE = (
    ("Promised intervals", "Expected", "promised/expected", 1.0),
    ("Promised intervals", "± promised", "promised/promised", 1.0),
    ("Promised intervals", "± rehearsed", "promised/scatter", 1.0),
)

CASES = (
    Case("fit", "fit", lambda: [frf_result(60, 4)], (*_PARAMETERS, ("Starts", "Cost", "starts/cost", 1.0))),
    Case(
        "fit-of-modes",
        "fit",
        lambda: [modal_result(profiles={})],
        (*_PARAMETERS, ("Starts", "Cost", "starts/cost", 1.0)),
        frfs=False,
    ),
    Case(
        "modes",
        "modes",
        lambda: [modes_result()],
        (
            ("Modes, table", "Frequency", "measurements/table/modes/frequency_hz", 1.0),
            ("Modes, table", "Damping ratio", "measurements/table/modes/damping_ratio", 100.0),
        ),
    ),
    Case(
        "compare",
        "compare",
        _two_runs,
        (
            ("Parameters", "first", "parameters/value", 1.0),
            ("Modes, posture1", "first", "measurements/posture1/modes/frequency_hz", 1.0),
        ),
    ),
    Case(
        "discovery",
        "discovery",
        lambda: [discovery_result()],
        (
            ("Added effects", "Gap", "added/gap", 1.0),
            ("Added effects", "Gap, other data", "added/gap_validation", 1.0),
            ("Added effects", "Log odds", "added/log_odds", 1.0),
            ("Candidates of step 1", "Gap", "steps/0/options/gap", 1.0),
            ("Candidates of step 2", "Log odds", "steps/1/options/log_odds", 1.0),
            ("Candidates of step 3", "Gap, other data", "steps/2/options/gap_validation", 1.0),
            ("Parameters", "final model", "after/parameters/value", 1.0),
            ("Parameters", "study's model", "before/parameters/value", 1.0),
        ),
    ),
    Case(
        "discovery-of-nothing",
        "discovery",
        lambda: [null_result()],
        (
            ("Candidates of step 1", "Gap", "steps/0/options/gap", 1.0),
            ("Parameters", "Fitted", "before/parameters/value", 1.0),
        ),
    ),
    Case("motion", "motion", lambda: [motion_result()], _MOTION, shapes=False, frfs=False),
    Case("batch", "batch", lambda: [batch_result()], _BATCH, shapes=False, frfs=False),
    Case("explained", "explained", lambda: [explain_result()], _EXPLAINED, shapes=False, frfs=False),
    Case("joints", "joints", lambda: [joints_result()], _JOINTS, shapes=False, frfs=False),
    Case("map", "map", lambda: [map_result()], _MAP, shapes=False, frfs=False),
    Case("deflection", "deflection", lambda: [deflection_result()], _DEFLECTION, shapes=False, frfs=False),
    Case("excite", "excitation", lambda: [excite_result()], _EXCITE, shapes=False, frfs=False),
    Case("plan", "plan", lambda: [plan_result()], _PLAN, shapes=False, frfs=False),
    Case("stability", "stability", lambda: [stability_result()], _STABILITY, shapes=False, frfs=False),
)


def page_of(result: Any) -> str:
    """The page of a result."""
    return page(result, report_of(result))


def document_of(result: Any) -> Document:
    """The PDF of a result, in the making."""
    return document(result, report_of(result))


@dataclass(frozen=True)
class Made:
    """The reports of a case: result files, HTML, PDF, the folder of its export; the result as it was read
    from its files, and the document that was printed.
    """

    case: Case
    files: list[Path]
    page: Path
    printed: Path
    exported: Path
    result: Any
    document: Document

    @cached_property
    def text(self) -> list[str]:
        """The lines of the PDF."""
        return lines(self.printed)


def make(case: Case, folder: Path) -> Made:
    """Write the results of a case and their reports into a folder."""
    files = []
    for name, result in zip(("first", "second"), case.make(), strict=False):
        files.append(folder / f"{name}.h5")
        result_file.write(result, files[-1])
    kept: list[tuple[Any, Document]] = []

    def keeping(result: Any, report: Report) -> Document:
        kept.append((result, document(result, report)))
        return kept[-1][1]

    with patch("identify.reports.write.document", keeping):
        written = write_reports(*files, export=folder / "figures")
    return Made(case, files, *written, *kept[-1])
