"""GET /docs: every operation of the interface, and nothing that comes from elsewhere or runs."""

import re
import shlex
from html.parser import HTMLParser

import pytest
from starlette.testclient import TestClient

from service.app import create_app
from service.settings import Settings

VOID = {"meta", "link", "img"}


class Read(HTMLParser):
    """What a browser would see: its texts, links and ids; raises where a tag is not closed in its place."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.links: list[str] = []
        self.texts: list[tuple[str, str]] = []
        self.feed(page)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        assert tag != "script"
        assert not [name for name in given if name.startswith("on") or name == "style"]
        self.ids += [given["id"] or ""] if "id" in given else []
        self.links += [given[name] or "" for name in ("href", "src") if name in given]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append((self.open[-1] if self.open else "", data))


@pytest.fixture(scope="module")
def http(tmp_path_factory: pytest.TempPathFactory) -> TestClient:
    """A client of an app that was never started: its pages need no store."""
    return TestClient(create_app(Settings(data=tmp_path_factory.mktemp("docs"))))


@pytest.fixture(scope="module")
def read(http: TestClient) -> Read:
    answer = http.get("/docs")
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    return Read(answer.text)


def test_every_operation_and_every_answer_is_on_it(http: TestClient, read: Read) -> None:
    document = http.get("/openapi.json").json()
    operations = [op for path in document["paths"].values() for op in path.values()]
    assert sorted(read.ids) == sorted([op["operationId"] for op in operations] + [*document["components"]["schemas"]])
    codes = {text for tag, text in read.texts if tag == "code"}
    assert codes >= set(document["paths"])
    assert codes >= {p["name"] for op in operations for p in op.get("parameters", ())}
    assert codes >= {"samples.theta_i_deg", "conserve_energy", "theta_deg", "datasets"}  # fields of bodies


def test_nothing_of_it_comes_from_elsewhere(http: TestClient, read: Read) -> None:
    inner = {link.removeprefix("#") for link in read.links if link.startswith("#")}
    assert inner <= set(read.ids)
    outer = {link for link in read.links if not link.startswith("#")}
    assert all(http.get(link).status_code == 200 for link in outer)
    assert outer >= {"/", "/openapi.json", "/static/page.css", "/static/docs.css"}
    assert http.get("/redoc").status_code == 404


def test_its_examples_are_lines_for_a_shell(idle: TestClient, read: Read) -> None:
    lines = [shlex.split(text) for tag, text in read.texts if tag == "pre"]
    assert len(lines) > 30
    assert all(line[:2] == ["curl", "-sS"] and line[-1].startswith("http://testserver/") for line in lines)
    assert not any("{" in line[-1] for line in lines)
    (fit,) = [line for line in lines if line[-1] == "http://testserver/v1/fits" and "-d" in line]
    body = fit[fit.index("-d") + 1]
    assert idle.post("/v1/fits", content=body, headers={"content-type": "application/json"}).status_code == 202


def test_words_of_the_interface_are_no_markup(http: TestClient, read: Read) -> None:
    said = "".join(text for _, text in read.texts)
    assert 'held values, such as {"kurt.f0": 0.04}' in said
    assert "list (1 to 32) of string (1 to 2000 characters) or null" in said
    assert "integer (1 to 100)" in said
    assert "number (above 0, at most 90) or null" in said
    assert not re.search(r"&(lt|gt|amp|quot);", said)
    assert http.get("/docs", headers={"accept": "application/json"}).status_code == 406
