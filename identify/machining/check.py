"""`identify check` of a tool: it is read, and its cut is looked at."""

from __future__ import annotations

from pathlib import Path

from identify.machining.tool import read_tool
from identify.measured.finding import STUDY, Checked, Finding


def run_checks(config: Path) -> Checked:
    """Read a tool as `identify stability` does; InputError or InputErrors where it cannot be used."""
    tool = read_tool(config).study
    cutting = tool.cutting(str(config))
    sentence = (
        f"{tool.teeth} teeth, {tool.diameter_mm:g} mm; cutting force of {cutting.tangential / 1e6:.4g} N/mm2,"
        f" {cutting.source}."
    )
    return Checked({STUDY: [Finding("info", "tool", (), sentence)]}, (), "stability FIT.h5 --tool")
