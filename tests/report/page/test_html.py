import base64
import hashlib
import re
from html.parser import HTMLParser

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bayes_hw.report.page.render import to_html
from bayes_hw.report.page.typography import visible

HOSTILE = (
    '<script>alert(1)</script></title> "quoted" & \'single\' {{ 7*7 }} {% raw %} #eval("1") '
    "$x$ \\ @a ../../etc/passwd \u202eabc\x00"
)
VOID = {"wbr", "meta", "link", "img", "br", "input", "hr"}


class Page(HTMLParser):
    """Text, tags, ids and links of a page; fails on tags that do not balance."""

    def __init__(self, source):
        super().__init__()
        self.open, self.text, self.tags, self.ids, self.links, self.sources = [], [], [], [], [], []
        self.feed(source)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        if tag not in VOID:
            self.open.append(tag)
        self.tags.append(tag)
        for name, value in attrs:
            assert not name.startswith("on"), f"inline handler {name}"
            if name == "id":
                self.ids.append(value)
            if name == "href" and value.startswith("#"):
                self.links.append(value[1:])
            elif name in ("src", "href"):
                self.sources.append(value)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def test_hostile_text_shows_as_text_and_adds_no_element(report_of):
    hostile, harmless = Page(to_html(report_of(HOSTILE))), Page(to_html(report_of("harmless")))
    assert hostile.tags == harmless.tags
    assert hostile.text.count(visible(HOSTILE)) == harmless.text.count("harmless") > 15


def test_contents_lead_to_every_section_and_ids_are_unique(report_of):
    page = Page(to_html(report_of("text")))
    assert page.links == ["section-1", "section-2"]
    assert len(set(page.ids)) == len(page.ids)
    assert set(page.links) <= set(page.ids)


def test_page_needs_nothing_from_outside_and_forbids_it(report_of):
    source = to_html(report_of("text"))
    assert all(address.startswith("data:") for address in Page(source).sources)
    assert "default-src 'none'" in source
    assert not re.search(r"url\(|@import", source)


def test_policy_admits_exactly_the_script_of_the_page(report_of):
    source = to_html(report_of("text"))
    script = re.findall(r"<script>(.*?)</script>", source, re.DOTALL)
    assert len(script) == 1
    digest = base64.b64encode(hashlib.sha256(script[0].encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in source.replace("&#39;", "'")


def test_same_report_gives_same_page(report_of):
    assert to_html(report_of("text")) == to_html(report_of("text"))


@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(text=st.text(alphabet=st.characters(exclude_categories=()), max_size=60))
def test_any_text_leaves_the_page_well_formed(report_of, text):
    source = to_html(report_of(text))
    source.encode("utf-8")
    Page(source)
