"""Checks the built site: version and social card on every page, and that links within the site lead to pages and anchors."""

import html.parser
import json
import pathlib
import re
import struct
import sys
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parents[2]
TAGS = ["og:title", "og:description", "og:image", "twitter:card", "twitter:title", "twitter:description", "twitter:image"]


class Page(html.parser.HTMLParser):
    """Links, anchors and meta tags of a page."""

    def __init__(self, text):
        super().__init__()
        self.links, self.anchors, self.meta = [], set(), {}
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        """Collects what one tag has."""
        given = dict(attrs)
        self.anchors |= {given[key] for key in ("id", "name") if given.get(key)}
        self.links += [given[key] for key in ("href", "src") if given.get(key)]
        if tag == "meta":
            self.meta[given.get("property") or given.get("name")] = given.get("content")


def target(path, link):
    """The file and anchor that a link within the site leads to, or None for other links."""
    parts = urllib.parse.urlsplit(link)
    if parts.scheme or parts.netloc:
        return None
    place = (path.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else path
    return place / "index.html" if place.is_dir() else place, urllib.parse.unquote(parts.fragment)


def mistakes(folder, version):
    """What is wrong with the site of one version, a line each."""
    pages = {path: Page(path.read_text()) for path in sorted(folder.resolve().rglob("*.html"))}
    if not pages:
        yield f"{folder}: no pages; run ./quickstart site"
    for path, page in pages.items():
        if "/reference/cpp/" not in path.as_posix() and path.name != "404.html":
            footer = path.read_text().partition("md-copyright__highlight")[2][:200]
            if not re.search(rf"\brelign-bench {re.escape(version)}\s", footer):
                yield f"{path}: version {version} is missing in the footer"
            yield from (f"{path}: the meta tag {tag} is missing" for tag in TAGS if not page.meta.get(tag))
            image = target(path, page.meta.get("og:image") or "")
            if image and not image[0].is_file():
                yield f"{path}: the picture {image[0]} does not exist"
        if path.name == "404.html":
            continue  # its links are absolute
        for place, anchor in filter(None, (target(path, link) for link in page.links)):
            if not place.is_file():
                yield f"{path}: link to {place}, which does not exist"
            elif anchor and place in pages and anchor not in pages[place].anchors and not anchor.startswith("__"):
                yield f"{path}: link to {place}#{anchor}, which does not exist"
    card = folder / "docs" / "images" / "card.png"
    if not card.is_file() or struct.unpack(">II", card.read_bytes()[16:24]) != (1200, 630) or card.stat().st_size > 150_000:
        yield f"{card}: not a PNG of 1200 x 630 pixels and at most 150 kB; run docs/site/card.py"
    if version not in [entry["version"] for entry in json.loads((folder.parent / "versions.json").read_text())]:
        yield f"{folder.parent / 'versions.json'}: version {version} is missing"


if __name__ == "__main__":
    current = re.search(r"^project\(relign-bench VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text(), re.M)[1]
    found = list(mistakes(pathlib.Path(sys.argv[1]) / current, current))
    print(*found[:50], sep="\n", file=sys.stderr)
    sys.exit(1 if found else 0)
