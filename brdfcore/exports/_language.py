"""The small language that a material's shader is generated from, and its two dialects: GLSL and Python.

A routine is a list of lines `name = expression` over floats and a result. The expressions are valid in both languages
as they stand: numbers with a point, + - * /, comparisons, and calls of exp, log, sqrt, sin, cos, erf, pow(x, y),
atan(y, x), max, min, choose(condition, then, else), vec3(r, g, b) and other routines. So what is tested by running the
Python dialect holds for the GLSL dialect too. Only arguments and results may have colour.
"""

import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass

_NAME = re.compile(r"[A-Za-z_]\w*")


@dataclass(frozen=True)
class Routine:
    """A function of floats; those of its arguments that are in `coloured` are red, green and blue, as is the result.

    `lines` holds one assignment a line. A routine of several results exists in the Python dialect only.
    """

    name: str
    arguments: tuple[str, ...]
    lines: str
    results: tuple[str, ...]
    coloured: frozenset[str] = frozenset()

    @property
    def assignments(self) -> list[tuple[str, str]]:
        """Names and expressions, in order."""
        pairs = (line.split(" = ", 1) for line in self.lines.strip().splitlines())
        return [(name.strip(), expression.strip()) for name, expression in pairs]

    @property
    def names(self) -> frozenset[str]:
        """Every name that the routine reads or calls."""
        return names_in([expression for _, expression in self.assignments] + list(self.results))


def names_in(expressions: Iterable[str]) -> frozenset[str]:
    """The names that expressions hold."""
    return frozenset(name for expression in expressions for name in _NAME.findall(expression))


def used(needed: Collection[str], library: Iterable[Routine]) -> list[Routine]:
    """The routines of a library that the needed names call, directly or not, in the library's order."""
    known = {routine.name: routine for routine in library}
    found: set[str] = set()
    new = set(needed) & known.keys()
    while new:
        found |= new
        new = {name for routine in new for name in known[routine].names & known.keys()} - found
    return [routine for name, routine in known.items() if name in found]


def pruned(lines: str, result: str) -> str:
    """The lines that the result depends on."""
    needed, kept = set(names_in([result])), []
    for line in reversed(lines.strip().splitlines()):
        name, expression = line.split(" = ", 1)
        if name in needed:
            needed = (needed - {name}) | names_in([expression])
            kept.append(line)
    return "\n".join(reversed(kept))


def to_python(routine: Routine) -> str:
    """The routine as Python."""
    lines = [f"    {name} = {expression}" for name, expression in routine.assignments]
    return "\n".join(
        [f"def {routine.name}({', '.join(routine.arguments)}):", *lines, f"    return {', '.join(routine.results)}"]
    )


def to_glsl(routine: Routine) -> str:
    """The routine as GLSL."""
    arguments = ", ".join(f"{_glsl_type(name in routine.coloured)} {name}" for name in routine.arguments)
    lines = [f"    float {name} = {expression};" for name, expression in routine.assignments]
    head = f"{_glsl_type(bool(routine.coloured))} {routine.name}({arguments}) {{"
    return "\n".join([head, *lines, f"    return {routine.results[0]};", "}"])


def _glsl_type(coloured: bool) -> str:
    return "vec3" if coloured else "float"


def number(values: float | list[float]) -> str:
    """A value as both dialects write it, exact in double precision."""
    return f"vec3({', '.join(map(repr, values))})" if isinstance(values, list) else repr(float(values))


# Routines that several models call. 1/(1 + x) and the logarithm of 1 + x lose digits as x goes to 0, hence the series.
LIBRARY = (
    Routine("sq", ("x",), "", ("x * x",)),
    Routine("fifth", ("x",), "", ("sq(sq(x)) * x",)),
    Routine(
        "log1p_over",
        ("x",),
        """
        y = min(x, 0.1)
        high = 1.0 / 8.0 - y * (1.0 / 9.0 - y * (1.0 / 10.0 - y / 11.0))
        middle = 1.0 / 5.0 - y * (1.0 / 6.0 - y * (1.0 / 7.0 - y * high))
        series = 1.0 - y * (1.0 / 2.0 - y * (1.0 / 3.0 - y * (1.0 / 4.0 - y * middle)))
        z = max(x, 0.1)
        """,
        ("choose(x < 0.1, series, log(1.0 + z) / z)",),
    ),
    Routine("schlick", ("c",), "", ("fifth(max(1.0 - c, 0.0))",)),
    Routine("passed", ("x",), "", ("x * (5.0 + x * (-10.0 + x * (10.0 + x * (-5.0 + x))))",)),
    Routine(
        "dielectric",
        ("c", "eta"),
        """
        n2_less_1 = (eta - 1.0) * (eta + 1.0)
        g = sqrt(n2_less_1 + sq(c))
        s = n2_less_1 / sq(g + c)
        sine2 = max((1.0 - c) * (1.0 + c), 0.0)
        p_over_s = (c * g - sine2) / (c * g + sine2)
        """,
        ("0.5 * sq(s) * (1.0 + sq(p_over_s))",),
    ),
    Routine(
        "conductor",
        ("c", "eta", "k"),
        """
        real = (eta - 1.0) * (eta + 1.0) - sq(k)
        imaginary = 2.0 * eta * k
        x = real + sq(c)
        larger = sqrt(0.5 * (sqrt(sq(x) + sq(imaginary)) + max(x, -x)))
        smaller = 0.5 * imaginary / max(larger, 1e-18)
        a = choose(x < 0.0, smaller, larger)
        b = choose(x < 0.0, larger, smaller)
        sum2 = sq(a + c) + sq(b)
        s2 = (sq(real) + sq(imaginary)) / sq(sum2)
        sine2 = max((1.0 - c) * (1.0 + c), 0.0)
        cb2 = sq(c * b)
        p_over_s2 = (sq(c * a - sine2) + cb2) / (sq(c * a + sine2) + cb2)
        """,
        ("0.5 * s2 * (1.0 + p_over_s2)",),
    ),
    Routine(
        "grooves_lose",
        ("mu",),
        """
        s2 = max((1.0 - mu) * (1.0 + mu), 1e-30)
        s = sqrt(s2)
        steep = PI / 2.0 - s * atan(s, mu)
        grazing = PI / 2.0 * sq(mu) / (1.0 + s) + s * atan(mu, s)
        """,
        ("choose(mu > 0.5, steep, grazing) + mu * (s2 / 3.0 - 2.0 / 3.0 * (mu + s) / (1.0 + s))",),
    ),
)
