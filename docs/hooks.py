"""Hooks of MkDocs: the notebook, and files of the repository that pages link to, become part of the site.

Pages are read on GitHub as well, so their links are paths in the repository. A link out of docs/book leads to a
page of docs/notebook, or to a file that is copied to the site; one to a file that does not exist is a warning,
which --strict makes an error. So is the name of a file as code. Links of pages outside of both books are checked as
well.
"""

import logging
import os
import posixpath
import re
from pathlib import Path

from mkdocs.structure.files import File
from pymdownx.slugs import slugify

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
log = logging.getLogger("mkdocs.hooks.links")

# Pages that only GitHub shows.
OUTSIDE = ["README.md", "CHANGELOG.md", "docs/README.md", "models/README.md", "plugins/README.md"]

FENCE = re.compile(r"^ *(```|~~~)")
LINK = re.compile(r"(\]\()([^()\s]+)(\))")
CODE = re.compile(r"`[^`\n]+`")
PATH = re.compile(r"`((?:src|tests|examples|benches|plugins|models|docs)/[\w./-]+)`")


def on_files(files, config):
    """Adds the pages and pictures of the notebook as notebook/…; checks the pages that are not in the site."""
    for name in OUTSIDE:
        check(ROOT / name)
    for path in sorted((HERE / "notebook").iterdir()):
        add(files, config, f"notebook/{path.name}", path)
    return files


def add(files, config, uri, path):
    if files.get_file_from_path(uri) is None:
        files.append(File.generated(config, uri, abs_src_path=str(path)))


def plain(text):
    """The lines of a page that are no code."""
    fenced = False
    for line in text.split("\n"):
        fence = FENCE.match(line)
        fenced ^= bool(fence)
        if not fenced and not fence:
            yield line


def anchors(page):
    slug = slugify(case="lower")
    titles = (line.lstrip("#").strip() for line in plain(page.read_text()) if line.startswith("#"))
    return {slug(re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", title).replace("`", ""), "-") for title in titles}


def check(page):
    """Warns of links to files and headings that do not exist."""
    for line in plain(page.read_text()):
        for link in LINK.finditer(line):
            path, _, anchor = link[2].partition("#")
            if re.match(r"[a-z]+:", link[2]):
                continue
            target = page.parent / path if path else page
            if not target.exists():
                log.warning("%s links to %s, which does not exist", page.relative_to(ROOT), link[2])
            elif anchor and anchor not in anchors(target):
                log.warning("%s links to %s, which has no such heading", page.relative_to(ROOT), link[2])


def on_page_markdown(markdown, page, config, files):
    """Rewrites links out of the book, languages of code, and pipes in code of tables, which GitHub wants escaped."""
    source = Path(page.file.abs_src_path).parent
    folder = posixpath.dirname(page.file.src_uri)
    lines, fenced = [], False
    for line in markdown.split("\n"):
        if FENCE.match(line):
            fenced = not fenced
            line = line.split(",")[0]  # rust,no_run is rust
        elif not fenced:
            line = LINK.sub(lambda link: relinked(link, source, folder, page, config, files), line)
            # The notebook may name what is gone.
            for path in PATH.findall(line) if source.is_relative_to(HERE / "book") else []:
                if "NAME" not in path and not (ROOT / path).exists():
                    log.warning("%s names %s, which does not exist", page.file.src_uri, path)
            if line.lstrip().startswith("|"):
                line = CODE.sub(lambda code: code[0].replace(r"\|", "|"), line)
        lines.append(line)
    return "\n".join(lines)


def relinked(link, source, folder, page, config, files):
    path, mark, anchor = link[2].partition("#")
    if not path or re.match(r"[a-z]+:", path):
        return link[0]
    target = Path(os.path.normpath(source / path))
    if not target.is_file():
        log.warning("%s links to %s, which is not a file", page.file.src_uri, link[2])
        return link[0]
    for room, prefix in [(HERE / "book", ""), (HERE / "notebook", "notebook/"), (ROOT, "repository/")]:
        if target.is_relative_to(room):
            uri = prefix + target.relative_to(room).as_posix()
            break
    else:
        log.warning("%s links to %s, outside of the repository", page.file.src_uri, link[2])
        return link[0]
    if uri.startswith("repository/"):
        # A verbatim copy: a page of the repository is not a page of the book.
        uri += ".txt" if target.suffix not in {".png", ".svg", ".toml", ".sh", ".py", ".rs", ".txt"} else ""
        add(files, config, uri, target)
    return f"{link[1]}{posixpath.relpath(uri, folder or '.')}{mark}{anchor}{link[3]}"
