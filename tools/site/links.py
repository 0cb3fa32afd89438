"""Checks that links of the book lead to files and anchors: `links.py FOLDER`. Pages of `cargo doc` and `pdoc` are found, their links not
followed. No anchor may have a name by which the book's scripts look for a loader of modules: search and copying end there."""

from __future__ import annotations

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

LOADERS = {"define", "exports", "module", "require"}


class Page(HTMLParser):
    def __init__(self, path: Path) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.anchors: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if name in ("href", "src") and value:
                self.targets.append(value)
            elif name in ("id", "name") and value:
                self.anchors.add(value)


def main(folder: str) -> int:
    root = Path(folder).resolve()
    pages: dict[Path, Page] = {}

    def page_of(path: Path) -> Page:
        if path not in pages:
            pages[path] = Page(path)
        return pages[path]

    wrong, n = [], 0
    # 404.html is shown in place of any page, so its links have no folder to start from.
    for path in sorted(path for path in root.glob("*.html") if path.name != "404.html"):
        wrong += [f"{path.relative_to(root)}: a heading's anchor is `{name}`" for name in sorted(page_of(path).anchors & LOADERS)]
        for target in page_of(path).targets:
            link = urlsplit(target)
            if link.scheme or link.netloc:
                continue
            n += 1
            there = (path.parent / unquote(link.path)).resolve() if link.path else path
            there = there / "index.html" if there.is_dir() else there
            if not there.is_file():
                wrong.append(f"{path.relative_to(root)}: {target}")
            elif link.fragment and there.suffix == ".html" and unquote(link.fragment) not in page_of(there).anchors:
                wrong.append(f"{path.relative_to(root)}: {target} (no such anchor)")
    print(f"{n} links of {len(pages)} pages followed")
    for line in wrong:
        print(f"wrong: {line}")
    if n < 500:
        print("so few links cannot be all")
    return int(bool(wrong) or n < 500)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
