"""GLSL's built-in functions in OpenCL C, for the types of one call.

Each text is a template: ``{T}`` is the type of the result (real, real3, int2, ...), ``{A}`` that of the first argument,
``{S}`` the scalar of a vector. Operands come widened to ``{T}``, except the last one of refract.
"""

from __future__ import annotations

#: Built-ins that OpenCL has with the same meaning, and their names there.
SAME: dict[str, str] = {
    **{
        name: name
        for name in "sin cos tan asin acos sinh cosh tanh exp log exp2 log2 sqrt floor ceil trunc pow".split()
    },
    **{name: name for name in "dot cross expm1 log1p".split()},
    "inversesqrt": "rsqrt",
    "round": "rint",
}

#: Built-ins as expressions of their arguments; used where an argument is needed once.
INLINE: dict[str, str] = {
    "radians": "({0} * R(0.017453292519943295))",
    "degrees": "({0} * R(57.29577951308232))",
}

HELPERS: dict[str, str] = {
    "abs": "static {T} {name}({T} x) {{ return x < 0 ? -x : x; }}",
    "sign": "static {T} {name}({T} x) {{ return x > 0 ? ({T})(1) : (x < 0 ? ({T})(-1) : ({T})(0)); }}",
    "mod": "static {T} {name}({T} x, {T} y) {{ return x - y * floor(x / y); }}",
    "fract": "static {T} {name}({T} x) {{ return x - floor(x); }}",
    "min": "static {T} {name}({T} x, {T} y) {{ return y < x ? y : x; }}",
    "max": "static {T} {name}({T} x, {T} y) {{ return x < y ? y : x; }}",
    "clamp": "static {T} {name}({T} x, {T} a, {T} b) {{ x = x < a ? a : x; return b < x ? b : x; }}",
    "mix": "static {T} {name}({T} x, {T} y, {T} t) {{ return x + (y - x) * t; }}",
    "step": "static {T} {name}({T} e, {T} x) {{ return x < e ? ({T})(0) : ({T})(1); }}",
    "smoothstep": (
        "static {T} {name}({T} a, {T} b, {T} x) {{\n"
        "    {T} t = (x - a) / (b - a);\n"
        "    t = t > 0 ? t : ({T})(0);\n"
        "    t = t < 1 ? t : ({T})(1);\n"
        "    return t * t * (3 - 2 * t);\n}}"
    ),
    "reflect": "static {T} {name}({T} v, {T} m) {{ return v - 2 * {dot} * m; }}",
    "refract": (
        "static {T} {name}({T} v, {T} m, real eta) {{\n"
        "    real d = {dot};\n"
        "    real k = 1 - eta * eta * (1 - d * d);\n"
        "    return k < 0 ? ({T})(0) : eta * v - (eta * d + sqrt(k)) * m;\n}}"
    ),
    "length": "static real {name}({A} x) {{ return sqrt(dot(x, x)); }}",
    "distance": "static real {name}({A} x, {A} y) {{ x -= y; return sqrt(dot(x, x)); }}",
}

NORMALIZE = """static {T} {name}({T} v) {{
    real d = dot(v, v);
    if (d > R(1.0e-30) && d < R(1.0e30)) return v * rsqrt(d);
    real m = {largest};
    if (!(m > 0)) return ({T})(0);
    v = v / m;
    return v * rsqrt(dot(v, v));
}}"""

DIVIDE = """static {T} {name}({T} a, {T} b) {{
    {T} q = a / (b == 0 || b == -1 ? ({T})(1) : b);
    return b == 0 ? ({T})(0) : (b == -1 ? 0 - a : q);
}}"""
REMAINDER = "static {T} {name}({T} a, {T} b) {{ return b == 0 ? ({T})(0) : a - {divide}(a, b) * b; }}"
DIVIDE_UNSIGNED = """static {T} {name}({T} a, {T} b) {{
    return b == 0 ? ({T})(0) : a / (b == 0 ? ({T})(1) : b);
}}"""

#: One component of a vector by a run-time index, clamped.
COMPONENT = {
    2: "static {S} {name}({T} v, int i) {{ return i <= 0 ? v.x : v.y; }}",
    3: "static {S} {name}({T} v, int i) {{ return i <= 0 ? v.x : (i == 1 ? v.y : v.z); }}",
    4: "static {S} {name}({T} v, int i) {{ return i <= 1 ? (i <= 0 ? v.x : v.y) : (i == 2 ? v.z : v.w); }}",
}

MATRIX = "typedef struct {{ real{n} c[{n}]; }} mat{n};"
TRANSFORM = "static real{n} ng_transform{n}(mat{n} m, real{n} v) {{ return {sum}; }}"


def start(real: str) -> str:
    """Return the first lines of every program: the type ``real`` and its literals."""
    lines = []
    if real == "double":
        lines.append("#pragma OPENCL EXTENSION cl_khr_fp64 : enable")
    lines += [f"typedef {real}{n} real{n};" for n in ("", "2", "3", "4")]
    lines.append(f"#define R(x) {'x##f' if real == 'float' else 'x'}")
    lines += [f"#define TO_REAL{n}(x) convert_{real}{n}(x)" for n in ("2", "3", "4")]
    for n in ("2", "3", "4"):  # a comparison of vectors gives 0 or -1 in ints as wide as what was compared
        lines.append(f"#define BOOLS{n}(x) {'(x)' if real == 'float' else f'convert_int{n}(x)'}")
        lines.append(f"#define MASK{n}(x) {'(x)' if real == 'float' else f'convert_long{n}(x)'}")
    return "\n".join(lines)
