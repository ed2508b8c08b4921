"""Hooks of MkDocs: the notebook, and files of the repository that pages link to, become part of the site.

Pages are read on GitHub as well, so their links are paths in the repository. A link out of docs/book leads to a
page of docs/notebook, or to a file that is copied to the site; one to a file that does not exist is a warning,
which --strict makes an error.
"""

import logging
import os
import posixpath
import re
from pathlib import Path

from mkdocs.structure.files import File

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
log = logging.getLogger("mkdocs.hooks.links")

FENCE = re.compile(r"^ *(```|~~~)")
LINK = re.compile(r"(\]\()([^()\s]+)(\))")
CODE = re.compile(r"`[^`\n]+`")


def on_files(files, config):
    """Adds the pages and pictures of the notebook as notebook/…."""
    for path in sorted((HERE / "notebook").iterdir()):
        add(files, config, f"notebook/{path.name}", path)
    return files


def add(files, config, uri, path):
    if files.get_file_from_path(uri) is None:
        files.append(File.generated(config, uri, abs_src_path=str(path)))


def on_page_markdown(markdown, page, config, files):
    """Rewrites links out of the book, and pipes in code of tables, which GitHub wants escaped."""
    source = Path(page.file.abs_src_path).parent
    folder = posixpath.dirname(page.file.src_uri)
    lines, fenced = [], False
    for line in markdown.split("\n"):
        if FENCE.match(line):
            fenced = not fenced
        if not fenced:
            line = LINK.sub(lambda link: relinked(link, source, folder, page, config, files), line)
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
        log.warning("%s links to %s, which is no file", page.file.src_uri, link[2])
        return link[0]
    for room, prefix in [(HERE / "book", ""), (HERE / "notebook", "notebook/"), (ROOT, "repository/")]:
        if target.is_relative_to(room):
            uri = prefix + target.relative_to(room).as_posix()
            break
    else:
        log.warning("%s links to %s, outside of the repository", page.file.src_uri, link[2])
        return link[0]
    if uri.startswith("repository/"):
        # A copy as it is: a page of the repository is no page of the book.
        uri += ".txt" if target.suffix not in {".png", ".svg", ".toml", ".sh", ".py", ".rs", ".txt"} else ""
        add(files, config, uri, target)
    return f"{link[1]}{posixpath.relpath(uri, folder or '.')}{mark}{anchor}{link[3]}"
