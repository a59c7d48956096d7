"""The page without a browser: what is served, under which policy, and that nothing of it points elsewhere."""

import pathlib
import re
import tomllib

import pytest
from starlette.testclient import TestClient

from service.routes.page import FOLDER, files

BROWSER = {"accept": "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8"}
POLICY = "default-src 'self'; base-uri 'none'; form-action 'none'; object-src 'none'; frame-ancestors 'none'"
ROOT = pathlib.Path(__file__).parents[2]
OWN = [path for path in sorted(FOLDER.iterdir()) if path.is_file()]


def test_the_way_in_is_a_page_for_browsers_and_json_for_others(http: TestClient) -> None:
    page = http.get("/", headers=BROWSER)
    assert page.headers["content-type"] == "text/html; charset=utf-8"
    assert page.text.startswith("<!doctype html>")
    assert http.get("/", headers={"accept": "application/json"}).json()["docs"] == "/docs"
    assert http.get("/").json()["docs"] == "/docs"
    assert all(answer.headers["vary"].startswith("accept, accept-encoding") for answer in (page, http.get("/")))
    refused = http.get("/", headers={"accept": "image/png"})
    assert refused.status_code == 406
    assert refused.json()["detail"].startswith("Expected Accept to admit application/json or text/html")


def test_every_file_is_served_with_its_type_under_the_strict_policy(http: TestClient) -> None:
    types = {"html": "text/html", "js": "text/javascript", "css": "text/css", "svg": "image/svg+xml", "csv": "text/csv"}
    assert {"index.html", "main.js", "page.css", "example.csv", "plotly/plotly-basic.min.js"} <= set(files())
    for name, path in files().items():
        answer = http.get(f"/static/{name}")
        assert answer.content == path.read_bytes()
        assert answer.headers["content-security-policy"] == POLICY
        assert answer.headers["content-type"].partition(";")[0] == types.get(path.suffix[1:], "text/plain")
        again = http.get(f"/static/{name}", headers={"if-none-match": answer.headers["etag"]})
        assert (again.status_code, again.content) == (304, b"")
        plain = http.get(f"/static/{name}", headers={"accept-encoding": "identity"})
        assert (plain.content, plain.headers["etag"]) == (answer.content, answer.headers["etag"])
        assert (answer.headers.get("content-encoding"), plain.headers.get("content-encoding")) == ("gzip", None)
        assert all("accept-encoding" in one.headers["vary"] for one in (plain, answer))


def test_the_largest_file_travels_small(http: TestClient) -> None:
    largest = max(files(), key=lambda name: files()[name].stat().st_size)
    sent = int(http.get(f"/static/{largest}").headers["content-length"])
    assert sent <= 450_000
    assert sent <= files()[largest].stat().st_size / 2.5


def test_the_policy_of_the_page_is_for_the_page_only(http: TestClient) -> None:
    assert http.get("/", headers=BROWSER).headers["content-security-policy"] == POLICY
    assert http.get("/docs").headers["content-security-policy"] == POLICY
    assert http.get("/v1/models").headers["content-security-policy"].startswith("default-src 'none'")


@pytest.mark.parametrize("name", ["none.js", "../app.py", "%2e%2e/app.py", "..%2fapp.py", "", "plotly", "/etc/passwd"])
def test_nothing_else_is_served(http: TestClient, name: str) -> None:
    answer = http.get(f"/static/{name}")
    assert answer.status_code == 404
    assert answer.json()["detail"].startswith("Expected ")


@pytest.mark.parametrize("path", OWN, ids=lambda path: path.name)
def test_a_file_names_no_other_place_and_holds_nothing_that_the_policy_forbids(path: pathlib.Path) -> None:
    text = path.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")  # a name, never fetched
    assert not re.search(r"https?:|//cdn|@import|\burl\(", text)
    assert not re.search(r"\son\w+=\"|style=\"|javascript:|\beval\(|new Function|innerHTML", text)
    if path.suffix == ".html":
        assert all(" src=" in tag for tag in re.findall(r"<script[^>]*>", text))
        assert "<style" not in text


def test_every_module_is_imported_and_every_import_exists() -> None:
    modules = {path.name: path.read_text(encoding="utf-8") for path in OWN if path.suffix == ".js"}
    used = {name for text in modules.values() for name in re.findall(r"from \"\./(\w+\.js)\"", text)}
    assert used | {"main.js"} == set(modules)
    for name, text in modules.items():
        assert text.startswith("/** "), f"{name} says first what it is"
        assert len(text.splitlines()) <= 200
        for function in re.findall(r"^export (?:async )?(?:function|class) (\w+)", text, re.MULTILINE):
            assert re.search(rf"\*/\nexport (?:async )?(?:function|class) {function}\b", text), f"{name}: {function}"


def test_every_element_that_a_module_asks_for_is_in_the_page_or_made_by_a_module() -> None:
    page = (FOLDER / "index.html").read_text(encoding="utf-8")
    modules = "".join(path.read_text(encoding="utf-8") for path in OWN if path.suffix == ".js")
    known = set(re.findall(r"\bid=\"([\w-]+)\"", page)) | set(re.findall(r"\bid: \"([\w-]+)\"", modules))
    asked = set(re.findall(r"\b(?:at|complain)\(\"([\w-]+)\"", modules))
    assert asked <= known


def test_the_library_of_figures_comes_with_its_licence_and_version() -> None:
    head = (FOLDER / "plotly" / "plotly-basic.min.js").read_bytes()[:400].decode()
    assert re.search(r"plotly\.js \(basic - minified\) v\d+\.\d+\.\d+", head)
    assert "MIT" in (FOLDER / "plotly" / "LICENSE").read_text(encoding="utf-8")


def test_an_installed_package_has_every_file() -> None:
    patterns = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["package-data"]["service"]
    packed = {path for pattern in patterns for path in (ROOT / "service").glob(pattern) if path.is_file()}
    assert packed >= {path for path in FOLDER.rglob("*") if path.is_file()}


def test_the_readme_names_the_page() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert "`GET /`" in readme
    assert "pip install -e '.[dev,page]'" in readme
