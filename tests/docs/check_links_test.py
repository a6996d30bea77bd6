"""Links that lead nowhere are named, and what only looks like a link is not."""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "docs/site"))
from check_links import documents, faults_of_documents, faults_of_site
from markdown_pages import anchors, links_of


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)

    def write(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


class DocumentsTest(Folder):
    def test_links_to_files_and_sections_that_exist_pass(self):
        self.write("README.md", "# Top\n[page](docs/A.md) [part](docs/A.md#two-parts) [here](#top) ![i](docs/i.svg)\n")
        self.write("docs/A.md", "# A\n## Two parts\n[up](../README.md#top)\n")
        self.write("docs/i.svg", "")
        self.assertEqual(faults_of_documents(self.root), [])

    def test_a_missing_file_is_named_with_its_line(self):
        self.write("README.md", "# Top\n\n```\n[no](link.md)\n```\n\n[page](docs/GONE.md)\n")
        self.assertEqual(faults_of_documents(self.root), ["README.md:7: docs/GONE.md: no such file in the repository"])

    def test_a_missing_section_is_named_with_those_that_exist(self):
        self.write("README.md", "# Top\n[part](#tops)\n")
        self.assertEqual(faults_of_documents(self.root), ["README.md:2: #tops: no such section; there are: top"])

    def test_a_file_outside_the_repository_is_a_fault(self):
        self.write("README.md", "# Top\n[part](../../../../../../etc/passwd)\n")
        self.assertEqual(len(faults_of_documents(self.root)), 1)

    def test_the_image_of_a_link_is_checked_too(self):
        self.write("README.md", "[![text](gone.png)](https://example.org)\n")
        self.assertEqual(len(faults_of_documents(self.root)), 1)

    def test_documents_of_this_repository_are_found(self):
        self.assertIn(Path("docs/TUTORIAL.md"), documents(ROOT))
        self.assertGreater(sum(len(links_of((ROOT / path).read_text(encoding="utf-8"))) for path in documents(ROOT)), 100)


class SiteTest(Folder):
    def test_pages_whose_links_all_lead_somewhere_pass(self):
        self.write("a.html", '<h1 id="x">x</h1><a href="b.html#y">b</a><a href="#x">x</a><a href="https://example.org">e</a>')
        self.write("b.html", '<a name="y"></a><img src="i.png">')
        self.write("i.png", "")
        self.assertEqual(faults_of_site(self.root), [])

    def test_missing_pages_images_and_anchors_are_named(self):
        self.write("a.html", '<a href="b.html">b</a><a href="#x">x</a><img src="i.png">')
        self.assertEqual(faults_of_site(self.root), ["a.html: b.html: no such file of the site", "a.html: #x: no such anchor",
                                                     "a.html: i.png: no such file of the site"])

    def test_addresses_of_a_script_are_checked_too(self):
        self.write("a.html", '<h1 id="x">x</h1>')
        self.assertEqual(faults_of_site(self.root, ["a.html#x"]), [])
        self.assertEqual(faults_of_site(self.root, ["a.html#y"]), ["(script): a.html#y: no such anchor"])

    def test_a_folder_without_pages_is_a_fault(self):
        self.assertEqual(len(faults_of_site(self.root)), 1)


class MarkdownTest(unittest.TestCase):
    def test_anchors_are_lower_case_words_and_hyphens(self):
        headings = ["find_package(dtr)", "11.1 Completed depth", "`dtr bench`: error, time", "[Link](x.md) and *more*"]
        self.assertEqual(anchors(headings), ["find_packagedtr", "111-completed-depth", "dtr-bench-error-time", "link-and-more"])

    def test_equal_headings_are_numbered(self):
        self.assertEqual(anchors(["Same", "Same", "Same"]), ["same", "same-1", "same-2"])

    def test_code_is_no_link_but_a_link_may_have_code_as_text(self):
        self.assertEqual(links_of("`[a](b)` [`c`](d.md)\n[e](f.md#g_(h))\n"), [(1, "d.md"), (2, "f.md#g_(h)")])


class ProgramTest(unittest.TestCase):
    def test_wrong_usage_ends_with_2(self):
        done = subprocess.run([sys.executable, ROOT / "scripts/check-links", "--help"], capture_output=True, text=True)
        self.assertEqual(done.returncode, 2)
        self.assertIn("usage: scripts/check-links [SITE]", done.stderr)


if __name__ == "__main__":
    unittest.main()
