"""Who may import whom: downwards only, the library never the service, no model another model; and what files hold."""

import ast
import importlib
import inspect
import pathlib
import re
import subprocess
import sys

import pytest

import brdfcore as bc

ROOT = pathlib.Path(bc.__file__).parent.parent
PACKAGE = ROOT / "brdfcore"
FILES = sorted(PACKAGE.rglob("*.py"))

# The house, ground floor first; a part imports from parts above it in this list, or from itself.
FLOORS = [
    ["errors", "_types"],
    ["geometry"],
    ["parameters"],
    ["models"],
    ["hard_cases"],
    ["formats"],
    ["tabulated"],
    ["sampling"],
    ["energy"],
    ["bounds"],
    ["fitting"],
    ["exports"],
    ["render"],
    ["plots"],
    ["study"],
    ["cli"],
]
FLOOR_OF = {name: floor for floor, names in enumerate(FLOORS) for name in names}


def module_name(path: pathlib.Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(path: pathlib.Path, *, at_import: bool = False) -> set[str]:
    """The absolute names that a file imports; with `at_import`, only those outside functions and type checks."""
    package = module_name(path).split(".")
    if path.name != "__init__.py":
        package = package[:-1]
    found: set[str] = set()

    def visit(node: ast.AST) -> None:
        if at_import and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            return
        if at_import and isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            return
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            stem = ".".join([*base, *([node.module] if node.module else [])])
            found.update(f"{stem}.{alias.name}" for alias in node.names)
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(ast.parse(path.read_text(encoding="utf-8")))
    return found


def part(name: str) -> str | None:
    """The part of the house that an absolute name belongs to, None for the package itself and for others."""
    pieces = name.split(".")
    return pieces[1] if pieces[0] == "brdfcore" and len(pieces) > 1 and pieces[1] in FLOOR_OF else None


def test_the_walk_sees_imports():
    """The test of the tests: relative, nested and absolute imports are found where they are."""
    kurt = imports(PACKAGE / "models" / "kurt.py")
    assert "brdfcore.geometry.Geometry" in kurt
    assert "brdfcore.models._kurt_family.KurtFamily" in kurt
    assert "torch.Tensor" in kurt
    assert "brdfcore.models.MODELS" in imports(PACKAGE / "__init__.py")


@pytest.mark.parametrize("path", FILES, ids=module_name)
def test_the_library_never_imports_the_service(path):
    used = {name for name in imports(path) if name.split(".")[0] == "service"}
    if path.is_relative_to(PACKAGE / "cli"):
        used = {name for name in imports(path, at_import=True) if name.split(".")[0] == "service"}
    assert not used


@pytest.mark.parametrize("path", FILES, ids=module_name)
def test_imports_go_down_only(path):
    own = part(module_name(path))
    if own is None:
        return  # the package's own __init__, __main__ and data: they may gather everything
    for name in imports(path):
        other = part(name)
        assert other is None or other == own or FLOOR_OF[other] < FLOOR_OF[own], f"{module_name(path)} imports {name}"


SHARED = {"__init__", "base", "form", "material", "presets", "text", "fresnel"}
MODEL_FILES = [
    path for path in sorted((PACKAGE / "models").glob("*.py")) if path.stem not in SHARED and path.stem[0] != "_"
]


def test_every_model_file_is_in_the_registry():
    assert {path.stem for path in MODEL_FILES} == set(bc.MODELS)
    for name, model in bc.MODELS.items():
        assert model.name == name
        assert model.__module__ == f"brdfcore.models.{name}"
        assert issubclass(model, bc.Model)
        assert not inspect.isabstract(model)


@pytest.mark.parametrize("path", MODEL_FILES, ids=lambda path: path.stem)
def test_no_model_imports_another(path):
    models = {f"brdfcore.models.{other.stem}" for other in MODEL_FILES if other != path}
    beyond = {f"brdfcore.models.{name}" for name in ("form", "material", "presets", "text")}
    for name in imports(path):
        module = ".".join(name.split(".")[:3])
        assert module not in models | beyond, name
        assert name != "brdfcore.models.MODELS"


@pytest.mark.parametrize("path", MODEL_FILES, ids=lambda path: path.stem)
def test_a_models_docstring_has_its_equation_source_and_departure(path):
    text = importlib.import_module(f"brdfcore.models.{path.stem}").__doc__
    equation = [line for line in text.splitlines() if "f(wi, wo) =" in line]
    assert len(equation) == 1
    assert equation[0].rstrip().endswith("[1/sr]")
    assert re.search(r"^Source: .", text, re.MULTILINE)
    assert re.search(r"\bDeparture: .", text)
    assert text.splitlines()[0].endswith(".")
    for p in {p.name for choice in bc.MODELS[path.stem].with_words(()) for p in choice.parameters}:
        assert re.search(rf"\b{p}\b", text), f"{p} is not explained"


def test_docstrings_and_readme_cite_tests_that_exist():
    cited = {
        (path.name, named)
        for path in [*FILES, *(ROOT / "service").rglob("*.py"), ROOT / "README.md"]
        for named in re.findall(r"tests/[\w/]+\.py", path.read_text(encoding="utf-8"))
    }
    assert not [(file, named) for file, named in cited if not (ROOT / named).is_file()]


@pytest.mark.parametrize("path", FILES, ids=module_name)
def test_files_stay_short(path):
    """style.md: over 350 lines needs a reason."""
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 350


def test_importing_the_library_is_light():
    heavy = ("matplotlib", "fastapi", "pydantic", "typer", "rich", "httpx2", "uvicorn", "scipy", "pyarrow", "service")
    script = (
        "import sys, brdfcore; brdfcore.material('lambert + kurt'); "
        f"print(*[name for name in {heavy!r} if name in sys.modules])"
    )
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", script], capture_output=True, text=True, timeout=120, check=False
    )
    assert run.returncode == 0, run.stderr
    assert run.stdout.split() == []


def test_the_public_names():
    names = {"MODELS", "Material", "Model", "material", "__version__"}
    assert names <= set(bc.__all__)
    assert all(getattr(bc, name) is not None for name in names)
