"""The words of reports: one line each, said by the headings of tables."""

import re
from html import unescape

from actuator_lti.asked.quantities import QUANTITIES
from reports import document as doc
from reports.glossary import TERMS, glossary, meaning
from reports.html import environment


def test_every_figure_and_term_has_one_line() -> None:
    terms = glossary()
    assert {quantity.title or quantity.words for quantity in QUANTITIES.values()} | set(TERMS) == set(terms)
    assert list(terms) == sorted(terms, key=str.lower)
    assert all(line and "\n" not in line for line in terms.values())


def test_a_heading_of_a_table_says_its_line() -> None:
    headings = ("Disk margin", "Gain margin", "No term")
    block = doc.table("Words", [doc.column(f"c{k}", words) for k, words in enumerate(headings)], [])
    template = environment().from_string('{% import "blocks.html" as b with context %}{{ b.table(block) }}')
    page = template.render(block=block, unique=lambda letter: letter)
    found = {
        name: unescape(line)
        for line, name in re.findall(r'<th scope="col"[^>]*?(?: title="([^"]*)")?>([^<]*)<', page)
    }
    assert found == {name: meaning(name) for name in headings}
    assert found["Disk margin"] == TERMS["Disk margin"]
    assert found["Gain margin"] == QUANTITIES["gain_margin"].description
    assert found["No term"] == ""
