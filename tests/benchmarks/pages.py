"""Tables of the pages of studies, made from stored results of runs.

python -m tests.benchmarks.pages store NAME RESULT.h5 [TITLE ...]: what the terminal shows of a result, and
    the tables of its PDF with these titles, into results/pages
python -m tests.benchmarks.pages write: every marked table of docs/ anew

A page marks a table by `<!-- run NAME: TITLE -->`, of some columns by `<!-- run NAME: TITLE; HEAD; HEAD -->`,
what the run says first by `<!-- run NAME: verdict -->`, each up to `<!-- end of run -->`; a number in a
sentence by `<!-- cell NAME: TITLE; ROW; HEAD -->...<!-- end -->`, ROW being the first cells of its row. A
benchmark keeps tables of its own by `keep`.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
STORED = Path(__file__).parent / "results" / "pages"
BLOCK = re.compile(r"(<!-- run (\w+): ([^>]+?) -->\n)(.*?)(<!-- end of run -->)", re.DOTALL)
SECONDS = re.compile(r" after \d+\.\d s(?=;)")
"""How long a run took: another number each time."""
CELL = re.compile(r"(<!-- cell (\w+): ([^>]+?) -->)(.*?)(<!-- end -->)", re.DOTALL)


def stored(result: Path, more: Sequence[str] = ()) -> dict[str, Any]:
    """Verdict, notes and tables by title, as the terminal has them; more: titles of tables of the PDF."""
    from identify.reports.kinds import read_any, report_of
    from identify.reports.kit.report import PRINT, TERMINAL, Tabular

    read = read_any(result)
    report = report_of(read)
    shown = [part.table for part in report.shown(TERMINAL) if isinstance(part, Tabular)]
    pages = [part.table for part in report.shown(PRINT) if isinstance(part, Tabular)]
    shown += [table for table in pages if table.title in more]
    return {
        "verdict": [SECONDS.sub("", sentence) for sentence in read.verdict],
        "notes": list(read.notes),
        "tables": {
            table.title: {"head": [column.head for column in table.columns], "rows": table.rows}
            for table in shown
        },
    }


def tables(name: str) -> dict[str, Any]:
    """The tables of a stored run by title, each with its head and rows."""
    run: dict[str, Any] = json.loads((STORED / f"{name}.json").read_text(encoding="utf-8"))
    return {**run["tables"], "verdict": run["verdict"]}


def rendered(name: str, what: str) -> str:
    """The lines of a block; KeyError for a table or column that the run does not have."""
    title, *heads = what.split("; ")
    if title == "verdict":
        return "".join(f"> {sentence}\n" for sentence in tables(name)[title])
    table = tables(name)[title]
    wanted = [table["head"].index(head) for head in heads] if heads else range(len(table["head"]))
    rows = [table["head"], ["---"] * len(table["head"]), *table["rows"]]
    lines = [
        "|" + "|".join("---" if row[n] == "---" else f" {row[n]} " for n in wanted) + "|" for row in rows
    ]
    return "\n".join(lines) + "\n"


def cell(name: str, what: str) -> str:
    """One cell of a stored run; KeyError where no row, or more than one, begins so."""
    title, row, head = what.split("; ")
    table = tables(name)[title]
    rows = [cells for cells in table["rows"] if f"{', '.join(cells)}, ".startswith(f"{row}, ")]
    if len(rows) != 1:
        raise KeyError(f"{len(rows)} rows of {name}: {title} begin with {row}")
    return str(rows[0][table["head"].index(head)])


def rewritten(text: str) -> str:
    """A page with its blocks and cells as the stored runs have them."""
    text = BLOCK.sub(lambda found: found[1] + rendered(found[2], found[3]) + found[5], text)
    return CELL.sub(lambda found: found[1] + cell(found[2], found[3]) + found[5], text)


def keep(name: str, found: dict[str, list[list[str]]]) -> None:
    """Store tables by title, the first row of each the heads, as `results/pages/NAME.json`; print them."""
    _write(
        name,
        {
            "verdict": [],
            "notes": [],
            "tables": {title: {"head": rows[0], "rows": rows[1:]} for title, rows in found.items()},
        },
    )
    for title in found:
        print(f"{title}\n{rendered(name, title)}")


def _write(name: str, told: dict[str, Any]) -> None:
    """A row a line."""
    text = json.dumps(told, indent=1, ensure_ascii=False)
    text = re.sub(r"\[\s+(\"[^\[\]]*\")\s+\]", lambda row: f"[{' '.join(row[1].split())}]", text)
    STORED.mkdir(exist_ok=True)
    (STORED / f"{name}.json").write_text(text + "\n", encoding="utf-8")


def main() -> None:
    """Store a result, or write the pages."""
    if sys.argv[1] == "store":
        _write(sys.argv[2], stored(Path(sys.argv[3]), sys.argv[4:]))
        return
    for page in sorted((ROOT / "docs").glob("*.md")):
        text = page.read_text(encoding="utf-8")
        if (new := rewritten(text)) != text:
            page.write_text(new, encoding="utf-8")
            print(page)


if __name__ == "__main__":
    main()
