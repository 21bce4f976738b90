#!/usr/bin/env python3
"""Completes the book that mdbook has built, and checks its links and those of the repository.

    mdbook build && python3 tests/book/links.py

Pages of the book name files beside docs/ (cases, sources, CONTRIBUTING.md). Those are copied beside the book, pages in Markdown as plain text in
HTML, so that the same links work in the book, in a clone, and on a site that shows both. Then every internal link and every anchor
is followed: in the built pages, and in the Markdown files themselves. Addresses on the network are counted, not fetched.
"""

import html
import os
import re
import shutil
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

ROOT = Path(__file__).resolve().parents[2]
SITE = ROOT / "target" / "book"
BOOK = SITE / "docs"

FENCE = re.compile(r"^(```|~~~).*?^\1", re.M | re.S)
LINK = re.compile(r"!?\[(?:[^\]\[]|\[[^\]]*\])*\]\(<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\)")
HEADING = re.compile(r"^#{1,6}\s+(.*?)\s*#*$", re.M)


def slug(heading):
    """The anchor of a heading, as GitHub and mdBook make it."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
    text = re.sub(r"[`*]", "", text).strip().lower()
    return "".join(c if c.isalnum() or c in "_-" else "-" if c == " " else "" for c in text)


def without_code(text):
    return FENCE.sub("", text)


def anchors_of(markdown):
    """Every anchor of a page; the second heading of a name has -1 after it, and so on."""
    found, counts = set(), {}
    for heading in HEADING.findall(without_code(markdown)):
        name = slug(heading)
        count = counts.get(name, 0)
        counts[name] = count + 1
        found.add(name if count == 0 else f"{name}-{count}")
    return found


class Page(HTMLParser):
    """The links and anchors of a page."""

    def __init__(self, text):
        super().__init__()
        self.links, self.anchors = [], set()
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        for key, value in attributes:
            if key in ("href", "src") and value:
                self.links.append(value)
            elif key == "id" or (tag == "a" and key == "name"):
                self.anchors.add(value)


def is_remote(link):
    return bool(urlsplit(link).scheme) or link.startswith("//")


def as_page(source):
    """A file in Markdown as plain text, with the anchors of its headings."""
    lines, counts = [], {}
    for line in source.read_text(encoding="utf-8").splitlines():
        text = html.escape(line)
        heading = HEADING.match(line)
        if heading:
            name = slug(heading.group(1))
            count = counts.get(name, 0)
            counts[name] = count + 1
            text = f'<b id="{name if count == 0 else f"{name}-{count}"}">{text}</b>'
        lines.append(text)
    title = html.escape(str(source.relative_to(ROOT)))
    return f'<!DOCTYPE html>\n<meta charset="utf-8"><title>{title}</title>\n<pre style="white-space: pre-wrap">\n' + "\n".join(lines) + "\n</pre>\n"


def complete():
    """Puts beside the book what its pages link to."""
    count = 0
    for old in SITE.iterdir():
        if old.is_dir() and old != BOOK:
            shutil.rmtree(old)
        elif old.is_file():
            old.unlink()
    for page in BOOK.rglob("*.html"):
        for link in Page(page.read_text(encoding="utf-8")).links:
            if is_remote(link) or link.startswith("#"):
                continue
            target = Path(os.path.normpath(page.parent / unquote(urlsplit(link).path)))
            if target.exists() or BOOK in target.parents or SITE not in target.parents:
                continue
            source = ROOT / target.relative_to(SITE)
            target.parent.mkdir(parents=True, exist_ok=True)
            if source.is_dir():
                shutil.copytree(source, target, dirs_exist_ok=True)
            elif source.is_file():
                shutil.copyfile(source, target)
            elif target.suffix == ".html" and source.with_suffix(".md").is_file():
                target.write_text(as_page(source.with_suffix(".md")), encoding="utf-8")
            else:
                continue
            count += 1
    return count


def check_book():
    faults, count, remote = [], 0, 0
    pages = {page: Page(page.read_text(encoding="utf-8")) for page in sorted(SITE.rglob("*.html"))}
    for page, content in pages.items():
        # The page for addresses that do not exist has absolute links by design; the one for printing repeats all others.
        if page.name in ("404.html", "print.html", "toc.html"):
            continue
        for link in content.links:
            if is_remote(link):
                remote += 1
                continue
            count += 1
            parts = urlsplit(link)
            target = page if not parts.path else Path(os.path.normpath(page.parent / unquote(parts.path)))
            if not target.exists() or SITE not in [target, *target.parents]:
                faults.append(f"{page.relative_to(SITE)}: {link} leads nowhere")
            elif parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].anchors:
                faults.append(f"{page.relative_to(SITE)}: {link}: there is no such anchor")
    print(f"book: {len(pages)} pages, {count} internal links and pictures; {remote} addresses on the network are not fetched")
    return faults


def check_markdown():
    faults, count = [], 0
    skipped = {"target", ".git", "node_modules"}
    files = [path for path in sorted(ROOT.rglob("*.md")) if not skipped & set(path.relative_to(ROOT).parts)]
    for page in files:
        text = without_code(page.read_text(encoding="utf-8"))
        for link in LINK.findall(text):
            if is_remote(link):
                continue
            count += 1
            parts = urlsplit(link)
            target = page if not parts.path else Path(os.path.normpath(page.parent / unquote(parts.path)))
            if not target.exists():
                faults.append(f"{page.relative_to(ROOT)}: {link} leads nowhere")
            elif parts.fragment and target.suffix == ".md":
                if unquote(parts.fragment) not in anchors_of(target.read_text(encoding="utf-8")):
                    faults.append(f"{page.relative_to(ROOT)}: {link}: there is no such heading")
    # A page that no chapter names is not in the book.
    summary = (ROOT / "docs" / "SUMMARY.md").read_text(encoding="utf-8")
    named = {os.path.normpath(ROOT / "docs" / link) for link in LINK.findall(summary)}
    for page in sorted((ROOT / "docs").rglob("*.md")):
        if page.name != "SUMMARY.md" and str(page) not in named:
            faults.append(f"docs/SUMMARY.md does not name {page.relative_to(ROOT)}")
    print(f"Markdown: {len(files)} files, {count} internal links")
    return faults


def main():
    if not BOOK.is_dir():
        sys.exit("there is no target/book/docs: run mdbook build first")
    print(f"{complete()} files and folders were put beside the book")
    faults = check_book() + check_markdown()
    for fault in faults:
        print(fault, file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
