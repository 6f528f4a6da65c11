"""The site builds without warnings, and renders the pages correctly."""

import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import firstfix

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
# Paragraphs with a list, a table or a block of code that was not rendered: a blank line before it
# is missing, or the indent is not four spaces.
RUN_TOGETHER = re.compile(r"<p>(?:(?!</p>).)*\n(?:- |\* |\d+\. |\||```)", re.DOTALL)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build it, as `make docs` does."""
    for needed in ("mkdocs", "material", "mkdocstrings"):
        if importlib.util.find_spec(needed) is None:
            pytest.skip(f"without {needed}: pip install 'firstfix[docs]'")
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", folder],
        cwd=ROOT,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


@pytest.mark.slow
def test_every_public_name_has_its_entry(site: Path) -> None:
    page = (site / "reference" / "python.html").read_text(encoding="utf-8")
    for name in firstfix.__all__:
        assert re.search(rf'<h3 id="firstfix\.[\w.]*{name}"', page), name
    assert page.count("Parameters:") > len(firstfix.__all__) // 2
    assert page.count("Raises:") > 5


@pytest.mark.slow
def test_lists_and_tables_are_rendered(site: Path) -> None:
    for page in site.rglob("*.html"):
        found = RUN_TOGETHER.search(page.read_text(encoding="utf-8"))
        assert found is None, f"{page.relative_to(site)}: {found[0][-200:] if found else ''}"


@pytest.mark.slow
def test_pages_outside_of_docs_are_on_the_site(site: Path) -> None:
    assert (site / "CONTRIBUTING.html").exists()
    assert list((site / "benchmarks" / "reports").rglob("*.png"))


@pytest.mark.slow
def test_nothing_is_loaded_from_other_sites(site: Path) -> None:
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        assert not re.search(r'(?:src|<link[^>]*href)="(?:https?:)?//', text), page


def test_the_reference_names_every_public_name() -> None:
    page = (DOCS / "reference" / "python.md").read_text(encoding="utf-8")
    assert set(re.findall(r"^::: firstfix\.(\w+)$", page, re.MULTILINE)) == set(firstfix.__all__)


def test_the_changelog_has_the_version() -> None:
    assert f"\n## [{firstfix.__version__}]" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
