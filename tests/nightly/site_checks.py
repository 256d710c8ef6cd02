"""Checks of a published site that several tests share."""

import json
from functools import lru_cache
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit
from xml.etree import ElementTree

VOID = {"meta", "link", "input", "br", "hr", "img", "wbr", "path", "circle", "rect", "line"}


class Page(HTMLParser):
    """Tags with their attributes, and the text that is seen; ``open``: what was not closed."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.open: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        if tag in self.open:
            while self.open.pop() != tag:
                pass

    def handle_data(self, data: str) -> None:
        if self.open[-1:] not in (["style"], ["script"]):
            self.words.append(data)

    @property
    def names(self) -> list[str]:
        return [tag for tag, _ in self.tags]

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())

    def given(self, *keys: str) -> list[str]:
        """Values of attributes."""
        return [value or "" for _, given in self.tags for key, value in given.items() if key in keys]


def check_whole(site: Path) -> Page:
    """Every page reachable from the index is complete and every link leads to a file inside of the site."""
    seen: set[Path] = set()
    first = _check_page(site / "index.html", site, seen)
    json.loads((site / "summary.json").read_text())
    ElementTree.parse(site / "junit.xml")
    return first


@lru_cache(maxsize=256)
def _read(text: str) -> Page:
    """Most pages are those of the site before."""
    return Page(text)


def _check_page(path: Path, site: Path, seen: set[Path]) -> Page:
    seen.add(path)
    text = path.read_text(encoding="utf-8")
    page = _read(text)
    if path.name != "report.html":
        assert text.rstrip().endswith("</html>"), f"{path} is cut off"
        assert not page.open, f"{path}: {page.open} not closed"
    for link in page.given("href", "src", "xlink:href", "action", "srcset"):
        parts = urlsplit(link)
        if link.startswith("data:") or (not parts.path and not parts.netloc):
            continue
        assert not parts.scheme + parts.netloc, f"{path} asks {link}"
        target = (path.parent / unquote(parts.path)).resolve()
        assert target.is_relative_to(site.resolve()), f"{link} leaves the site"
        if target.name in ("summary.json", "junit.xml", "summary.md"):
            continue
        assert target.is_file(), f"{path.name}: {link} leads nowhere"
        if target.suffix == ".html" and target not in seen:
            _check_page(target, site.resolve(), seen)
    return page
