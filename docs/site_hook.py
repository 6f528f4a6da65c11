"""What makes the site like the repository: pages may link to files that lie outside docs/.

In the repository ``../CONTRIBUTING.md`` leads somewhere; mkdocs knows only what is below docs/. So
each file that a page links to comes into the site, at its path in the repository, and so does what
that file links to. A folder becomes a list of the documents below it.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[1]
DOCS = "docs/"
NOTES = "decisions"
LINK = re.compile(r"(?<=\]\()[^)#\s]+")


def on_config(config: Any) -> Any:
    """List the decision notes, so that a new one need not be named twice."""
    notes = sorted(path.name for path in (ROOT / DOCS / NOTES).glob("0*.md"))
    config.nav.append({"Decisions": [f"{NOTES}/{name}" for name in ("README.md", *notes)]})
    return config


def on_files(files: Any, config: Any) -> Any:
    """Add what pages link to and lies elsewhere in the repository."""
    waiting = [(DOCS + page.src_uri, page.content_string) for page in files.documentation_pages()]
    seen = set()
    while waiting:
        page, text = waiting.pop()
        for target in filter(None, (_target(page, link) for link in LINK.findall(text))):
            if target.startswith(DOCS) or target in seen:
                continue
            seen.add(target)
            content = _list_of(target) if (ROOT / target).is_dir() else None
            file = File.generated(
                config,
                _place(target),
                **({"content": content} if content else {"abs_src_path": str(ROOT / target)}),
            )
            files.append(file)
            if file.is_documentation_page():
                waiting.append((file.src_uri, file.content_string))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Turn links to files of the repository into links to their places in the site."""
    here = page.file.src_uri
    at = here if page.file.generated_by else DOCS + here

    def turned(link: re.Match[str]) -> str:
        target = _target(at, link[0])
        return posixpath.relpath(_place(target), posixpath.dirname(here)) if target else link[0]

    return LINK.sub(turned, markdown)


def _target(page: str, link: str) -> str | None:
    """Return the path in the repository of what a page links to, if there is such a thing."""
    path = posixpath.normpath(posixpath.join(posixpath.dirname(page), link))
    return path if not path.startswith("..") and (ROOT / path).exists() else None


def _place(path: str) -> str:
    if path.startswith(DOCS):
        return path[len(DOCS) :]
    return f"{path}/index.md" if (ROOT / path).is_dir() else path


def _list_of(folder: str) -> str:
    pages = sorted(path.relative_to(ROOT / folder) for path in (ROOT / folder).rglob("*.md"))
    lines = [f"- [{page.parent.as_posix()}]({page.as_posix()})\n" for page in pages]
    return f"# {folder}\n\n{''.join(lines)}"
