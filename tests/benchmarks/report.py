"""How large a page of 3,000 FRFs is, and how fast it opens beside one of 60: python -m
tests.benchmarks.report (needs `make browser`).
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from identify.results.fit import FitResult
from tests.reports.browser import browser
from tests.reports.kinds import page_of
from tests.reports.sample import frf_result, large_result


def main() -> None:
    """Size, first paint and the moment when the page can be used, ms, the best of three."""
    cases: dict[str, FitResult] = {"3,000 FRFs of 500 lines": large_result(), "60 FRFs": frf_result(60, 4)}
    with browser() as page, tempfile.TemporaryDirectory() as folder:
        for name, result in cases.items():
            path = Path(folder) / "page.html"
            path.write_text(page_of(result), encoding="utf-8")
            seen = []
            for _ in range(3):
                page.open(path)
                paint = float(page.run("performance.getEntriesByName('first-contentful-paint')[0].startTime"))
                seen.append((float(page.run("document.documentElement.dataset.ready")), paint))
            ready, paint = min(seen)
            print(
                f"{name}: {path.stat().st_size / 1e6:.1f} MB, first paint {paint:.0f} ms, ready"
                f" {ready:.0f} ms"
            )


if __name__ == "__main__":
    main()
