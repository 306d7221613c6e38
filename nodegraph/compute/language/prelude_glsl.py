"""Functions of the language that GLSL lacks or leaves open, in GLSL."""

from __future__ import annotations

#: Length 0 stays 0; lengths whose square leaves the range of a float are scaled first.
NORMALIZE = """{T} ng_normalize({T} v) {{
    float d = dot(v, v);
    if (d > 1.0e-30 && d < 1.0e30) return v * inversesqrt(d);
    float m = {largest};
    if (!(m > 0.0)) return {T}(0.0);
    v = v / m;
    return v * inversesqrt(dot(v, v));
}}"""

NORMALIZE_SCALAR = "float ng_normalize(float v) { return sign(v); }"

IDIV = """int ng_idiv(int a, int b) {
    int q = a / (b == 0 || b == -1 ? 1 : b);
    return b == 0 ? 0 : (b == -1 ? -a : q);
}"""
UDIV = "uint ng_udiv(uint a, uint b) { return b == 0u ? 0u : a / (b == 0u ? 1u : b); }"
IMOD = "int ng_imod(int a, int b) { return b == 0 ? 0 : a - ng_idiv(a, b) * b; }"
UMOD = "uint ng_umod(uint a, uint b) { return b == 0u ? 0u : a % (b == 0u ? 1u : b); }"

#: Tests by bits: some drivers drop comparisons of a value with itself.
ISNAN = "bool ng_isnan(float x) { return (floatBitsToUint(x) & 0x7fffffffu) > 0x7f800000u; }"
ISINF = "bool ng_isinf(float x) { return (floatBitsToUint(x) & 0x7fffffffu) == 0x7f800000u; }"

#: expm1: Taylor's polynomial of degree 6 near 0, where e^x - 1 loses digits; the driver's exp elsewhere. Ray-casters
#: call it for every visible sample with x < 0, where it is good to 6e-6 of its value (llvmpipe).
EXPM1 = """float ng_expm1(float x) {
    float p = x * (1.0 / 720.0) + (1.0 / 120.0);
    p = p * x + (1.0 / 24.0);
    p = p * x + (1.0 / 6.0);
    p = p * x + 0.5;
    return abs(x) < 0.0625 ? x + x * x * p : exp(x) - 1.0;
}"""

#: log1p: u = 1 + x with the rounding error c, u = 2^k m with m in [sqrt(1/2), sqrt(2)), and atanh's series for log m.
LOG1P = """float ng_log1p(float x) {
    if (ng_isnan(x) || x < -1.0) return uintBitsToFloat(0x7fc00000u);
    if (x == -1.0) return uintBitsToFloat(0xff800000u);
    if (ng_isinf(x)) return x;
    if (abs(x) < 1.0e-4) return x - x * x * (0.5 - x * (1.0 / 3.0));
    float k = 0.0;
    float f = x;
    float c = 0.0;
    if (x < -0.29289 || x > 0.41421) {
        float u = 1.0 + x;
        c = x > 1.0 ? 1.0 - (u - x) : x - (u - 1.0);
        c = c / u;
        uint bits = floatBitsToUint(u) - 0x3f3504f3u;
        int e = int(bits) >> 23;
        k = float(e);
        f = uintBitsToFloat((bits & 0x007fffffu) + 0x3f3504f3u) - 1.0;
    }
    float s = f / (2.0 + f);
    float z = s * s;
    float q = z * (0.66666667 + z * (0.4 + z * (0.28571429 + z * (0.22222222 + z * (0.18181818 + z * 0.15384615)))));
    float h = 0.5 * f * f;
    return k * 0.693359375 - ((h - (s * (h + q) + (k * (-2.12194440e-4) + c))) - f);
}"""
