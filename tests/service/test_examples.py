"""Every operation has an example, and the examples do what they show."""

from typing import Any

import pytest
from service_cases import csv_file
from starlette.testclient import TestClient

from service.examples import BODIES, PARAMETERS

SENT = [(method, path, name) for (method, path), bodies in BODIES.items() for name in bodies]


def test_every_operation_has_an_example(http: TestClient) -> None:
    paths = http.get("/openapi.json").json()["paths"]
    for path, operations in paths.items():
        for method, operation in operations.items():
            for parameter in operation.get("parameters", ()):
                assert parameter["name"] in PARAMETERS, (method, path, parameter["name"])
            if "requestBody" in operation:
                assert all(content["examples"] for content in operation["requestBody"]["content"].values())
    assert {(method, path) for method, path in BODIES} == {
        (method, path) for path, ops in paths.items() for method, op in ops.items() if "requestBody" in op
    }


@pytest.mark.parametrize(("method", "path", "name"), SENT)
def test_an_example_is_accepted(http: TestClient, method: str, path: str, name: str) -> None:
    body: Any = BODIES[method, path][name]
    if path in ("/v1/datasets", "/v1/sphere"):
        sent = {"content": body} if path == "/v1/datasets" else {"json": body}
        assert http.request(method, path, **sent).status_code in (200, 201)  # no JSON
        return
    uploaded = http.post("/v1/datasets", content=csv_file(), params={"quantity": "brdf"}).json()["id"]
    if "dataset" in body:
        body = body | {"dataset": uploaded}
    if "datasets" in body:
        body = body | {"datasets": [uploaded]}
    answer = http.request(method, path, json=body, headers={"prefer": "wait=20"})
    assert answer.status_code in (200, 202), answer.text
    assert answer.json().get("status", "succeeded") in ("succeeded", "queued", "running"), answer.text
