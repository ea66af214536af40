"""The links of a built site: files and anchors that they name, and what a page would fetch from a network."""

from __future__ import annotations

from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import NamedTuple
from urllib.parse import unquote, urlsplit

FETCHED = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src", "video": "src"}
"""Elements that a browser fetches with the page, and the attribute that names the file."""
NOT_FETCHED = {"canonical", "next", "prev", "index", "search", "genindex"}
"""Relations of a `link` that no browser follows by itself."""


class Link(NamedTuple):
    """A link of a page: its target, and whether a browser fetches it with the page."""

    target: str
    fetched: bool


class _Reader(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.links: list[Link] = []
        self.anchors: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = {name: value or "" for name, value in attrs}
        self.anchors |= {found[name] for name in ("id", "name") if name in found}
        if tag == "a" and "href" in found:
            self.links.append(Link(found["href"], False))
        elif tag in FETCHED and FETCHED[tag] in found and found.get("rel") not in NOT_FETCHED:
            self.links.append(Link(found[FETCHED[tag]], True))


def read_pages(site: Path) -> dict[Path, _Reader]:
    """Links and anchors of every page of a site."""
    pages: dict[Path, _Reader] = {}
    for path in site.rglob("*.html"):
        pages[path.resolve()] = reader = _Reader()
        reader.feed(path.read_text("utf-8"))
    return pages


def broken_links(pages: dict[Path, _Reader]) -> Iterator[str]:
    """Links to files and anchors that do not exist, addresses that are none, and files that need a network."""
    for path, page in pages.items():
        for link in page.links:
            parts = urlsplit(link.target)
            if parts.scheme == "data" or parts.scheme == "mailto":
                continue
            if parts.scheme or parts.netloc:
                if link.fetched or parts.scheme not in ("http", "https") or "." not in parts.netloc:
                    yield f"{path.name}: {link.target}"
                continue
            file = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            anchor = unquote(parts.fragment)
            known = not anchor or file.suffix != ".html" or (file in pages and anchor in pages[file].anchors)
            if not file.exists() or not known:
                yield f"{path.name}: {link.target}"
