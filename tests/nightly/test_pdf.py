"""Reports as PDF: what must stand in it stands in it, as text, with fonts embedded and page numbers."""

import io

import pytest
from nightly_builds import fake_document
from test_nightly_hostile import HOSTILE

from reports import document as doc
from reports.charts.chart import Chart
from reports.document import column, document, section, table, text, verdict, verdicts
from reports.pdf import clean, pdf_bytes, write_pdf
from tests.refusals import refused

pypdf = pytest.importorskip("pypdf")

CURVE = Chart(width=900.0, height=320.0)
CURVE.panel().curve([1.0, 2.0, 3.0], [1.0, 4.0, 9.0], "L")

ORIGIN = {"version": "1.2.3", "commit": "c" * 40, "design_hash": "d" * 64}
ORIGIN["time"] = "2026-01-02T03:04:05+00:00"


def rich_document(words: str = "plain words") -> dict:
    """A document with every kind of block."""
    made = fake_document({"name": words, "margin": 5.0, "label": words, "requirement": words, "loop": words})
    blocks = [
        text(words + "\n\nsecond paragraph"),
        doc.facts([doc.fact(words, 1.5, "V")]),
        doc.details(words, [text("folded")]),
        *([doc.figure("curves", CURVE, caption=words, alt=words)] if words == "plain words" else []),
    ]
    sections = [*made["sections"], section("more", words, blocks, intro=words)]
    design = {"name": words, "revision": "B"}
    return document(title=words, subtitle=words, design=design, provenance=ORIGIN, sections=sections)


def read(made: dict):
    return pypdf.PdfReader(io.BytesIO(pdf_bytes(made)))


def words_of(page) -> str:
    return " ".join(page.extract_text().replace("\u200b", "").split())


def test_cover_numbers_blocks_vectors_and_fonts_are_all_there() -> None:
    plain = read(rich_document())
    cover = words_of(plain.pages[0])
    pieces = ["plain words", "Revision B", "0 of 1 requirements met, 1 not met", "not met", "d" * 64]
    signing = ["Prepared", "Checked", "Approved", "Signature", "Date", "Name", "2026-01-02T03:04:05"]
    assert [piece for piece in pieces + signing if piece not in cover] == []
    count, each = len(plain.pages), list(map(words_of, plain.pages))
    assert count >= 2
    assert [k for k, words in enumerate(each, 1) if f"Page {k} of {count}" not in words] == []
    assert not any(list(page.images) for page in plain.pages)
    everything = " ".join(each)
    told = ("phase margin", "45.0", "velocity", "300.0", "folded", "1.5 V", "Contents", "second paragraph")
    assert [piece for piece in told if piece not in everything] == []
    fonts = [font for page in plain.pages for font in page["/Resources"].get("/Font", {}).values()]
    below = [one.get_object() for font in fonts for one in font.get_object().get("/DescendantFonts", [])]
    assert len(below) > 2
    for one in below:
        assert {"/FontFile", "/FontFile2", "/FontFile3"} & set(one["/FontDescriptor"].get_object())


def test_a_dozen_requirements_still_leave_room_to_sign_on_the_cover() -> None:
    met = {"value": 9.0, "limit": 6.0, "unit": "dB", "distance": 3.0, "passed": True, "source": "s"}
    items = [verdict(f"r{k}", f"requirement {k}", **met) for k in range(12)]
    blocks = [verdicts(items), verdicts(items[:2], what="checks"), verdicts(items[:2], what="odds")]
    parts, design = [section("verdicts", "Verdicts", blocks)], {"name": "a", "revision": "B"}
    about = {"title": "A drive", "subtitle": "words " * 30, "design": design, "provenance": ORIGIN}
    cover = words_of(read(document(**about, sections=parts)).pages[0])
    assert all(words in cover for words in ("12 of 12 requirements met", "requirement 11", "Signature"))


def test_type_is_no_smaller_than_8_points_and_what_is_said_is_not_grey() -> None:
    """A table of a dozen columns with its note, a requirement with its reason, a paragraph."""
    keys = [f"k{k}" for k in range(12)]
    wide = table("Wide", [column(key, key) for key in keys], [dict.fromkeys(keys, 1.0)], note="says the note")
    item = verdict("r", "asked", value=1.0, limit=6.0, unit="dB", passed=False, reason="says the reason")
    blocks = [verdicts([item]), wide, text("says the text")]
    colours, sizes, told = [], [], {}

    def painted(operator: bytes, operands: list[float], _cm: object, _tm: object) -> None:
        if operator == b"scn":
            colours.append(tuple(map(float, operands)))

    def written(words: str, _cm: object, _tm: object, _font: object, size: float) -> None:
        if words.strip():
            sizes.append(size)
            told[words.strip()] = colours[-1]

    parts = [section("s", "Section", blocks)]
    made = document(title="A drive", subtitle="", design={}, provenance=ORIGIN, sections=parts)
    for page in read(made).pages:
        page.extract_text(visitor_operand_before=painted, visitor_text=written)
    assert min(sizes) >= 8.0
    (colour,) = {told[f"says the {kind}"] for kind in ("note", "reason", "text")}
    assert max(colour) < 0.25


def test_the_same_document_is_typeset_the_same_and_its_file_written_whole_or_not_at_all(tmp_path) -> None:
    assert pdf_bytes(rich_document("once")) == pdf_bytes(rich_document("once"))
    assert write_pdf(rich_document("once"), tmp_path / "a" / "r.pdf").read_bytes().startswith(b"%PDF")
    (tmp_path / "file").write_text("x")
    refused(write_pdf, rich_document("once"), tmp_path / "file" / "r.pdf")


@pytest.mark.parametrize("words", HOSTILE, ids=range(len(HOSTILE)))
def test_hostile_words_are_typeset_as_they_are(words: str) -> None:
    made = read(rich_document(words))
    cover = words_of(made.pages[0])
    expected = " ".join(clean(words, 240).replace("\u200b", "").split())
    if expected.isascii() and len(expected) < 200:
        assert expected.replace(" ", "") in cover.replace(" ", "")
    assert not any("/URI" in str(a.get_object()) for p in made.pages for a in p.get("/Annots", []) or [])
    assert len(made.pages) < 30
