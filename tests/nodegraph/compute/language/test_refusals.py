"""Everything that lies outside the language is refused at the author's file and line, with what to write instead."""

# ruff: noqa: E501

from __future__ import annotations

import pytest

from nodegraph.compute import language
from nodegraph.errors import ShaderError

PIXEL = "vec4 pixel(ivec2 at) { return vec4(0.0); }"

#: A body of the entry (its line is 3), and a part of the message.
BODIES = {
    "float x = 1;": "x is a float, and this is an int: write 1.0",
    "float x = 2.0 * 3;": "write 3.0",
    "float x = max(0.5, 0);": "write 0.0",
    "vec3 a = vec3(1.0) + ivec3(1);": "write vec3(...)",
    "uint u = 1u + 1;": "write 1u",
    "int i = 1.5;": "write int(...)",
    "float x = y;": "y is not declared",
    "float value = 1.0; float x = valu;": "did you mean 'value'?",
    "float x = sin;": "sin is a function",
    "float x = foo(1.0);": "there is no function foo",
    "float x = clmp(1.0, 0.0, 1.0);": "did you mean 'clamp'?",
    "vec3 v = vec3(0.0); if (v == v) {}": "write all(equal(a, b))",
    "vec3 v = vec3(0.0); bool b = v < v;": "write lessThan(a, b)",
    "if (1) {}": "if takes a bool, not an int",
    "bvec2 b = lessThan(vec2(0.0), vec2(1.0)); if (b) {}": "write any(...) or all(...)",
    "bvec2 b = bvec2(true, false);": "comparison functions only",
    "bvec2 b = lessThan(vec2(0.0), vec2(1.0)); bool c = b.x;": "any(...) and all(...) only",
    "float x = 1.0 % 2.0;": "write mod(a, b)",
    "mat3 m = mat3(1.0); mat3 n = m * m;": "write transform(m, v)",
    "mat3 m = mat3(1.0); vec3 n = m * vec3(1.0);": "write transform(m, v)",
    "mat4 m = mat4(1.0); vec4 n = transform(m, vec3(1.0));": "it takes (mat4, vec4) or (mat3, vec3)",
    "float x = (1.0, 2.0);": "comma operator",
    "int i = 0; int j = i++ + 1;": "a statement of its own",
    "int i = 0; int j = ++i;": "a statement of its own",
    "float a = 0.0; float b = 0.0; a = b = 1.0;": "a statement of its own",
    "sin(1.0);": "no effect",
    "1.0;": "no effect",
    "switch (1) {}": "write if and else",
    "discard;": "return a flag",
    "float x = dFdx(1.0);": "not in the language",
    "vec4 c = texture(a, vec2(0.0));": "declare a field",
    "vec2 p = gl_FragCoord.xy;": "argument of its entry",
    "barrier();": "several runs",
    "double x = 1.0;": "float is the real number of the device",
    "float x[2]; x[2] = 1.0;": "the index 2 is outside 0..1",
    "float x[2]; float y = x[1.0];": "an index is an int",
    "float x[2]; float y = x[1u];": "write int(...)",
    "float x[0];": "outside 1..65536",
    "int n = 2; float x[n];": "a constant int",
    "float x[2][2];": "arrays of arrays",
    "float x[] = float[](1.0, 2.0); float n = x.length();": "constant",
    "float x[3] = float[2](1.0, 2.0);": "x is a float[3], and this is a float[2]",
    "float x[2] = float[2](1.0);": "2 values are needed, and 1 are given",
    "vec3 v = vec3(1.0, 2.0);": "vec3 needs 3 numbers, and 2 are given",
    "vec2 v = vec2(1.0, 2.0, 3.0);": "complete before this value",
    "vec2 v = vec2(0.0); float x = v.z;": "a vec2 has no .z",
    "vec2 v = vec2(0.0); vec2 x = v.xr;": "no swizzle",
    "vec2 v = vec2(0.0); v.xx = vec2(1.0);": "names a component twice",
    "vec4 v = vec4(0.0); v.xyz.x = 1.0;": "one swizzle at a time",
    "float x = 0.0; x.x = 1.0;": "has no components",
    "gain = 2.0;": "gain is a uniform and cannot be assigned",
    "const float k = 1.0; k = 2.0;": "k is a const",
    "PI = 2.0;": "PI is a const",
    "1.0 = 2.0;": "only a variable can be assigned",
    "field3 w = v;": "a field is no value",
    "float x = v;": "a field is no value",
    "float x = sample3(v, vec2(0.0));": "the position of sample3(field3, vec3) is a vec3",
    "float x = sample3(v);": "write sample3(field3, vec3)",
    "vec4 x = sample3v(v, vec3(0.0));": "use sample3 or fetch3 or size3",
    "float x = sample3(gain, vec3(0.0));": "a field is needed here",
    "float x = sample3(many, vec3(0.0));": "choose one field",
    "float x = sample3(many[2], vec3(0.0));": "outside 0..1",
    "float x = sample3(many[0.5], vec3(0.0));": "an index is an int",
    "break;": "break outside a loop",
    "continue;": "continue outside a loop",
    "return;": "write return value;",
    "return 1.0;": "the result of pixel is a vec4",
    "float x = 1.0; float x = 2.0;": "declared twice in one block",
    "float at = 1.0;": "declared twice in one block",
    "const float k;": "needs a value",
    "float x = true ? 1.0 : 2;": "write 2.0",
    "float x = 1.0 ? 1.0 : 2.0;": "?: takes a bool",
    "bool b = !1;": "compare with == or !=",
    "float x = -true;": "takes a number",
    "float x = ~1.0;": "~ takes int or uint",
    "int x = 1 << 1.0;": "takes int or uint",
    "bool b = true && 1;": "two bools",
    "bool b = true < false;": "does not order bools",
    "float x = 1.0 & 2.0;": "convert to int or uint first",
    "vec2 v = vec2(1.0) + vec3(1.0);": "the lengths differ",
    "float x = 1.0 + vec2(1.0);": "x is a float",
    "float x = 1.0; x += vec2(1.0);": "its target is a float",
    "bool b = true; b++;": "does not count",
    "S s = S(1.0);": "2 members, and 1 values",
    "S s = S(1.0, 2.0);": "b of S is an int",
    "S s; float x = s.c;": "S has no member c",
    "T t;": "a struct is declared before it is used",
    "float x = f(1.0, 2.0);": "f takes 1 arguments, and 2 are given",
    "float x = f(1);": "write 1.0",
    "vec4 x = pixel(at);": "pixel -> pixel is a recursion",
    "float if = 1.0;": "a word of the language",
    "float vec3 = 1.0;": "a word of the language",
    "float a__b = 1.0;": "no two underscores",
    "int i = 3000000000;": "write 3000000000u",
    "uint u = 5000000000u;": "32 bits",
    "int i = 017;": "octal",
    "float x = 1.0lf;": "is no number",
    "float x = 1e999;": "too large",
    "float x = 1.0": "';' is missing",
    "float x = ;": "an expression is needed before ';'",
    "float x = (1.0;": "')' is missing",
    "int x = $;": "no character of the language",
    "uniform float g2;": "outside functions",
    "for (int i = 0; i < 3; i++, i++) {}": "a statement of its own",
    "while (bool b = true) {}": "needed",
}  # fmt: skip

HEAD = "struct S {{ float a; int b; }}; const float PI = 3.0; uniform float gain; field3 v; field3 many[2]; float f(float x) {{ return x; }}\nvec4 pixel(ivec2 at) {{\n{}\nreturn vec4(0.0); }}"


@pytest.mark.parametrize("body", BODIES)
def test_refused_body(body: str) -> None:
    with pytest.raises(ShaderError) as caught:
        language.compile(HEAD.format(body))
    message = str(caught.value)
    assert BODIES[body] in message
    assert message.startswith("kernel.glsl:3: ")
    assert caught.value.line == 3
    assert body in message


#: A whole file, the line of the error, and a part of the message.
FILES = [
    ("", 1, "no entry"),
    (PIXEL + "\n" + "float voxel(ivec3 at) { return 0.0; }", 2, "two entries"),
    ("void main() {}", 1, "not main"),
    ("vec3 pixel(ivec2 at) { return vec3(0.0); }", 1, "use vec4"),
    ("bool pixel(ivec2 at) { return true; }", 1, "an output is"),
    ("float pixel(ivec3 at) { return 0.0; }", 1, "takes one ivec2"),
    ("float voxel() { return 0.0; }", 1, "takes one ivec3"),
    (f"float f(out float x) {{ return x; }}\n{PIXEL}", 1, "return a value, or a struct"),
    (f"float f(inout float x) {{ return x; }}\n{PIXEL}", 1, "return a value, or a struct"),
    (f"void f(float x) {{ }}\n{PIXEL}", 1, "return a value"),
    (f"{PIXEL}\nfloat f(float x) {{ return x; }}\nfloat f(vec2 x) {{ return x.x; }}", 3, "not overloaded"),
    (f"{PIXEL}\nfloat f(float x) {{\nreturn g(x);\n}}\nfloat g(float x) {{\nreturn f(x);\n}}", 6, "f -> g -> f is a recursion"),
    (f"{PIXEL}\nfloat f(float x) {{ return f(x); }}", 2, "f -> f is a recursion"),
    (f"{PIXEL}\nvec4 f() {{ return pixel(ivec2(0)); }}", 2, "cannot be called"),
    (f"{PIXEL}\nfloat sin(float x) {{ return x; }}", 2, "built-in"),
    (f"{PIXEL}\nfloat f(float x) {{ if (x > 0.0) return x; }}", 2, "can end without a value"),
    (f"{PIXEL}\nfloat f(float x) {{ while (true) {{ if (x > 0.0) break; }} }}", 2, "can end without a value"),
    (f"{PIXEL}\nfloat f(float x);", 2, "prototypes"),
    (f"{PIXEL}\nfloat f(float x, float x) {{ return x; }}", 2, "two parameters"),
    (f"{PIXEL}\nfloat f(field3 v[2]) {{ return 1.0; }}", 2, "pass one field"),
    (f"float gain;\n{PIXEL}", 1, "a global is a uniform, a const or a field"),
    (f"uniform bvec2 b;\n{PIXEL}", 1, "cannot be a bvec2"),
    (f"uniform sampler3D v;\n{PIXEL}", 1, "declare a field"),
    (f"uniform field3 v;\n{PIXEL}", 1, "cannot be a field3"),
    (f"uniform float a = 1;\n{PIXEL}", 1, "write 1.0"),
    (f"uniform float a = sin(1.0);\n{PIXEL}", 1, "the default of a uniform"),
    (f"uniform float a;\nuniform vec2 a;\n{PIXEL}", 2, "declared twice"),
    (f"uniform float a;\nconst float b = a;\n{PIXEL}", 2, "a is no constant"),
    (f"const float a;\n{PIXEL}", 1, "needs a value"),
    (f"const float a[2] = float[2](1.0, sin(1.0));\n{PIXEL}", 1, "made of numbers"),
    (f"struct S {{ float a; float a; }};\n{PIXEL}", 1, "two members"),
    (f"struct S {{ }};\n{PIXEL}", 1, "no members"),
    (f"struct S {{ field3 v; }};\n{PIXEL}", 1, "cannot be"),
    (f"struct S {{ float a; }} s;\n{PIXEL}", 1, "declares no variable"),
    ("struct S { float a; bool b; };\nS pixel(ivec2 at) { return S(1.0, true); }", 2, "an output is"),
    ("layout(location = 0) out vec4 color;", 1, "the translator chooses"),
    (f"#version 330\n{PIXEL}", 1, "leave #version out"),
    (f"#extension GL_foo : enable\n{PIXEL}", 1, "extensions"),
    (f"#define F(x) x\n{PIXEL}", 1, "write a function"),
    (f"#define A 1 + 2\n{PIXEL}", 1, "write a const"),
    (f"#define A 1\n#define A 2\n{PIXEL}", 2, "defined twice"),
    (f"#if A\n#endif\n{PIXEL}", 1, "A is not defined"),
    (f"#if 1 +\n#endif\n{PIXEL}", 1, "not complete"),
    (f"#if 1.5\n#endif\n{PIXEL}", 1, "compares integers"),
    (f"#if 1 / 0\n#endif\n{PIXEL}", 1, "division by zero"),
    (f"{PIXEL}\n#if 1", 2, "no #endif"),
    (f"{PIXEL}\n#endif", 2, "without an #if"),
    (f"{PIXEL}\n#if 1\n#else\n#else\n#endif", 4, "after #else"),
    (f"{PIXEL}\n/* open", 2, "never closed"),
    (f"{PIXEL}\n}}", 2, "is no type"),
    ("vec4 pixel(ivec2 at) {\n return vec4(0.0);", 1, "never closed"),
    (PIXEL + "\nfloat f(float x) { return " + "(" * 500 + "x" + ")" * 500 + "; }", 2, "nested more than"),
    (PIXEL + "\nfloat f(float x) { return x" + " + x" * 500 + "; }", 2, "use variables"),
    ("\n".join(f"float f{i}(float x) {{ return f{i + 1}(x); }}" for i in range(80)) + "\nfloat f80(float x) { return x; }\n" + PIXEL, 0, "more than 48 deep"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "line", "part"), FILES, ids=[part for _, _, part in FILES])
def test_refused_file(text: str, line: int, part: str) -> None:
    with pytest.raises(ShaderError) as caught:
        language.compile(text)
    assert part in str(caught.value)
    assert line in (0, caught.value.line)


def test_defines_of_the_host_are_checked() -> None:
    with pytest.raises(ShaderError, match=r"nothing here depends on the define LTI \(did you mean 'LIT'\?\)"):
        language.compile("#ifdef LIT\n#endif\n" + PIXEL, {"LTI": 1})
    for value in (float("nan"), "1", None, 1 << 40):
        with pytest.raises(ShaderError, match="LIT"):
            language.compile("#ifdef LIT\n#endif\n" + PIXEL, {"LIT": value})  # type: ignore[dict-item]
