"""The HTTP interface as a page, made of its OpenAPI document: nothing on it runs, and nothing comes from elsewhere."""

import json
import shlex
from collections.abc import Iterable, Mapping
from html import escape
from typing import Any

_HEAD = """<!doctype html>
<html lang="en">
<head>
  <meta charset="utf-8">
  <meta name="viewport" content="width=device-width, initial-scale=1">
  <meta name="color-scheme" content="light dark">
  <title>{title}: HTTP interface</title>
  <link rel="icon" href="/static/icon.svg" type="image/svg+xml">
  <link rel="stylesheet" href="/static/page.css">
  <link rel="stylesheet" href="/static/docs.css">
</head>
<body>
<header>
  <div class="brand">
    <img src="/static/icon.svg" alt="" width="36" height="36">
    <div><h1>{title} {version}: HTTP interface</h1><p>{summary}</p></div>
  </div>
  <nav aria-label="Elsewhere"><a href="/">The page</a><a href="/openapi.json">OpenAPI document</a></nav>
</header>
<main>
<p class="card">Every error is a problem document (RFC 9457) whose sentence says what to do. Angles are degrees.
Where the service needs a key, add <code>-H 'Authorization: Bearer KEY'</code>.</p>
"""


def page(document: Mapping[str, Any], url: str) -> str:
    """The page; its examples ask the service at `url`."""
    info = {name: escape(document["info"][name]) for name in ("title", "version", "summary")}
    groups: dict[str, list[str]] = {}
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            groups.setdefault(operation["tags"][0], []).append(_operation(method, path, operation, url))
    schemas = document["components"]["schemas"]
    sections = [_section(tag, found) for tag, found in groups.items()]
    sections.append(_section("What is answered", (_schema(name, schemas[name]) for name in sorted(schemas))))
    return "\n".join([_HEAD.format(**info), *sections, "</main>\n</body>\n</html>\n"])


def _section(title: str, parts: Iterable[str]) -> str:
    return f'<section class="card"><h2>{escape(title)}</h2>\n{"".join(parts)}</section>'


def _operation(method: str, path: str, operation: Mapping[str, Any], url: str) -> str:
    first, _, rest = operation["description"].partition("\n\n")
    parts = [f"<p>{_text(rest)}</p>" if rest else ""]
    given = [
        (parameter["name"], parameter["in"], parameter["schema"], parameter["required"])
        for parameter in operation.get("parameters", ())
    ]
    for content in operation.get("requestBody", {}).get("content", {}).values():
        required = content["schema"].get("required", ())
        for name, schema in content["schema"].get("properties", {}).items():
            given.append((name, "body", schema, name in required))
            given += [(f"{name}.{part}", "body", inner, False) for part, inner in _inner(schema).items()]
    if given:
        head = "<tr><th>name</th><th>in</th><th>what</th><th></th></tr>"
        rows = "".join(_row(name, schema, where, required=required) for name, where, schema, required in given)
        parts.append(f'<div class="scroll"><table><thead>{head}</thead><tbody>{rows}</tbody></table></div>')
    parts.append(f"<pre>{escape(_curl(method, path, operation, url))}</pre>")
    answers = {status: answer for status, answer in operation["responses"].items() if status < "400"}
    parts.append("".join(f"<p>{status}: {_answered(answer)}</p>" for status, answer in sorted(answers.items())))
    refused = ", ".join(sorted(status for status in operation["responses"] if status >= "400"))
    parts.append(f'<p class="note">Refusals: {refused}</p>' if refused else "")
    title = f'<b class="method {method}">{method.upper()}</b> <code>{escape(path)}</code> <span>{_text(first)}</span>'
    return _folded(operation["operationId"], title, "".join(parts))


def _schema(name: str, schema: Mapping[str, Any]) -> str:
    required = schema.get("required", ())
    rows = "".join(_row(field, part, required=field in required) for field, part in schema["properties"].items())
    title = f"<code>{escape(name)}</code> <span>{_text(schema.get('description', ''))}</span>"
    return _folded(name, title, f'<div class="scroll"><table><tbody>{rows}</tbody></table></div>')


def _folded(name: str, title: str, content: str) -> str:
    """What opens on a click; the id is inside, because browsers unfold what a link's target is in."""
    return f'<details><summary>{title}</summary><div id="{escape(name)}">\n{content}</div></details>\n'


def _row(name: str, schema: Mapping[str, Any], where: str | None = None, *, required: bool) -> str:
    cells = [f"<td><code>{escape(name)}</code></td>"]
    if where is not None:
        cells.append(f"<td>{where}{'' if required else ', optional'}</td>")
    default = schema.get("default")
    note = "" if default in (None, "", [], {}) else f" Default: {escape(json.dumps(default))}."
    cells.append(f"<td>{_type(schema)}</td><td>{_text(schema.get('description', ''))}{note}</td>")
    return f"<tr>{''.join(cells)}</tr>"


def _inner(schema: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of a field that is an object, or may be one."""
    found: dict[str, Any] = {}
    for part in (schema, *schema.get("anyOf", ())):
        found |= part.get("properties", {})
    return found


def _type(schema: Mapping[str, Any]) -> str:
    """What values a schema has, in words."""
    if "$ref" in schema:
        name = escape(schema["$ref"].rpartition("/")[2])
        return f'<a href="#{name}">{name}</a>'
    if "enum" in schema or "const" in schema:
        return " | ".join(escape(str(value)) for value in schema.get("enum", [schema.get("const")]))
    for key in ("anyOf", "oneOf"):
        if key in schema:
            return " or ".join(_type(part) for part in schema[key])
    kind = schema.get("type", "bytes" if schema.get("format") == "binary" else "any")
    if kind == "array":
        parts = schema.get("prefixItems") or [schema.get("items", {})]
        return f"list{_range(schema, 'minItems', 'maxItems')} of {', '.join(_type(part) for part in parts)}"
    if kind == "object" and isinstance(schema.get("additionalProperties"), dict):
        return f"object of {_type(schema['additionalProperties'])}"
    if kind == "string":
        return f"string{_range(schema, 'minLength', 'maxLength', ' characters')}"
    return f"{kind}{_range(schema, 'minimum', 'maximum')}"


def _range(schema: Mapping[str, Any], low: str, high: str, unit: str = "") -> str:
    """What a schema says of sizes, in brackets."""
    least, most = schema.get(low), schema.get(high)
    if least is not None and most is not None:
        said = [str(least) if least == most else f"{least} to {most}"]
    else:
        said = [f"{least} or more"] if least is not None else [f"at most {most}"] if most is not None else []
    if schema.get("type") in ("integer", "number"):
        words = (("exclusiveMinimum", "above"), ("exclusiveMaximum", "below"))
        said = [f"{word} {schema[name]}" for name, word in words if name in schema] + said
    return f" ({', '.join(said)}{unit})" if said else ""


def _answered(answer: Mapping[str, Any]) -> str:
    content = answer.get("content", {})
    what = [f"{_type(part['schema'])} ({kind})" if part.get("schema") else kind for kind, part in content.items()]
    said = "" if answer["description"] == "Successful Response" else f"{_text(answer['description'])}: "
    return said + (", ".join(what) or "nothing")


def _curl(method: str, path: str, operation: Mapping[str, Any], url: str) -> str:
    """A line for a shell that asks it."""
    words = ["curl", "-sS"]
    for parameter in operation.get("parameters", ()):
        if parameter["in"] == "path":
            path = path.replace(f"{{{parameter['name']}}}", str(parameter["example"]))
    body = operation.get("requestBody", {}).get("content", {})
    if "application/json" in body:
        example = next(iter(body["application/json"]["examples"].values()))["value"]
        words += ["-H", "Content-Type: application/json", "-d", json.dumps(example)]
    elif body:
        words += ["--data-binary", "@FILE"]
    elif method != "get":
        words += ["-X", method.upper()]
    return shlex.join([*words, f"{url}{path}"])


def _text(text: str) -> str:
    """A docstring's words, what stands between backticks as code."""
    parts = escape(" ".join(text.split())).split("`")
    return "".join(f"<code>{part}</code>" if number % 2 else part for number, part in enumerate(parts))
