"""Why the ends of a parameter's box are hard."""

from ..parameters import Parameter

_WIDTH = {
    "low": "cos theta_h = 1 - 5e-9 across the lobe: acos is noise",
    "high": "flat to the horizon: nothing hides what happens there",
}
_RADIUS = {"low": "roundings of h are divided by 1e-4", "high": _WIDTH["high"]}
_EXPONENT = {
    "low": "flat to the horizon: nothing hides what happens there",
    "high": "hz^n multiplies the rounding of hz by n",
}
_REFLECTANCE = {
    "low": "0 times an overflow is NaN",
    "high": "the lobe itself, and nothing to scale it down",
}
# By parameter and end; the models share these names.
WHY = {
    **dict.fromkeys(("a", "ax", "ay", "m", "mx", "my"), _WIDTH),
    **dict.fromkeys(("rx", "ry"), _RADIUS),
    **dict.fromkeys(("n", "nu", "nv"), _EXPONENT),
    **dict.fromkeys(("kd", "ks", "rs"), _REFLECTANCE),
    "f0": {
        "low": "F is (1 - h.wo)^5 alone, which cancels near retro",
        "high": "1 - f0 = 0: Schlick's other term vanishes",
    },
    "cx": {"low": "twice a mirror's: the power overflows", "high": "twice a retroreflector's: the power overflows"},
    "cy": {"low": "twice a mirror's: the power overflows", "high": "twice a retroreflector's: the power overflows"},
    "eta": {"low": "the thinnest medium", "high": "the densest medium"},
    "alpha": {"low": "a power of 0, whose derivative has a logarithm", "high": "1/(ci co) to the full power"},
    "sigma": {"low": "no roughness: 0/0 in quotients of it", "high": "facets that stand upright"},
    "k": {"low": "no absorption: the root of what may be negative", "high": "the best mirror"},
}

# Ends of another kind than the others of their name.
WHY_HERE = {
    "eta = 1.0001": "next to no surface: F is a difference that cancels",
    "eta = 0.01": "total reflection: the root of what may be negative",
}


def why_an_end_is_hard(p: Parameter, end: str, name: str) -> str:
    """The reason, in some 50 characters; for a parameter that is not known here, which end of what it is."""
    extreme = "lowest" if end == "low" else "highest"
    return WHY_HERE.get(name) or WHY.get(p.name, {}).get(end) or f"the {extreme} {p.description}"
