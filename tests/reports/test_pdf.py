"""The PDF: readable and complete."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest

from identify.reports.kit.cells import Column, Table, words
from identify.reports.kit.document import Document
from identify.results.fit import FitResult
from tests.reports.kinds import document_of
from tests.reports.pdf_text import lines, poppler
from tests.reports.sample import CONFIG, frf_result, modal_result


@pytest.fixture(scope="module", params=["frf", "modal"])
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[FitResult, Path]:
    result = frf_result() if request.param == "frf" else modal_result()
    path = tmp_path_factory.mktemp("pdf") / "run.pdf"
    path.write_bytes(document_of(result).compile(result))
    return result, path


def test_pages_are_numbered_and_named(made: tuple[FitResult, Path]) -> None:
    result, path = made
    pages = int(re.search(r"Pages:\s+(\d+)", poppler("pdfinfo", str(path)))[1])  # type: ignore[index]
    text = "\n".join(lines(path))
    assert pages >= 3
    assert re.findall(rf"(\d+) ?/ ?{pages}$", text, re.MULTILINE) == [
        str(page) for page in range(1, pages + 1)
    ]
    assert text.count(result.name) >= pages
    assert "A4" in poppler("pdfinfo", str(path))


def test_date_is_that_of_the_result(made: tuple[FitResult, Path]) -> None:
    assert re.search(r"CreationDate:.*Mar.*4.*2025", poppler("pdfinfo", str(made[1])))


def test_fonts_are_embedded(made: tuple[FitResult, Path]) -> None:
    rows = poppler("pdffonts", str(made[1])).splitlines()[2:]
    assert rows
    assert all(" yes yes " in row for row in rows)


def test_it_says_what_the_result_says(made: tuple[FitResult, Path]) -> None:
    result, path = made
    text = re.sub(r"\s+", " ", " ".join(lines(path))).replace("\u200b", "")
    for said in (*result.verdict, *(note[1:] for note in result.notes), *result.provenance.packages):
        assert said in text
    assert "offset.z" in text
    assert re.sub(r"\s+", " ", CONFIG.strip()) in text
    with_frf = any(m.frf for m in result.measurements.values())
    assert ("Frequency response functions" in text) == with_frf
    assert ("2 drive points and the 3 other FRFs with the largest gap" in text) == with_frf
    assert ("Modal assurance criterion" in text) == (not with_frf)


def test_long_text_leaves_room_for_the_numbers_beside_it(tmp_path: Path) -> None:
    result, made = frf_result(), Document()
    texts = [
        "posture1",
        "validation only",
        "13.4, 10.2, -1.9, 8.0, 50.0, 8.4",
        "to " * 60,
    ]
    columns = [words(f"Heading{n}", [text]) for n, text in enumerate(texts)]
    made.table(Table("", [*columns, Column("Gap", values=[1.019])]))
    path = tmp_path / "table.pdf"
    path.write_bytes(made.compile(result))
    found = poppler("pdftotext", "-bbox", str(path), "-")
    boxes = re.findall(r'xMin="([\d.]+)" yMin="([\d.]+)" xMax="([\d.]+)" .*?>(.*?)<', found)
    [(left, top, _, _)] = [one for one in boxes if one[3] == "1.019"]
    beside = [float(right) for _, y, right, text in boxes if y == top and text != "1.019"]
    assert len(beside) > 5
    assert max(beside) < float(left)


def test_six_of_many_postures_are_drawn(tmp_path: Path) -> None:
    result = modal_result()
    one = result.measurements["table"]
    many = dataclasses.replace(
        result, measurements={f"p{i}": dataclasses.replace(one, name=f"p{i}") for i in range(8)}
    )
    path = tmp_path / "many.pdf"
    path.write_bytes(document_of(many).compile(many))
    assert "The first 6 of 8 postures." in " ".join(lines(path))
