"""Print a checked kernel as a GLSL program."""

from __future__ import annotations

from . import prelude_glsl as prelude
from . import syntax as s
from .check_statements import left_early
from .fields_glsl import accessor_text, declarations
from .module import FieldSlot, Layout, Module
from .names import mangle
from .printing import FieldRef, Instance, Printer, Storages, bare, divides_plainly, is_int
from .types import BOOL, FLOAT, Array, Matrix, Numeric, Struct, Type
from .uniform_leaves import leaves

#: Thread groups of compute shaders.
GROUP = (8, 8, 1)

_IMAGES = {"float": "r32f", "vec2": "rg32f", "vec4": "rgba32f", "int": "r32i", "uint": "r32ui"}


def print_glsl(module: Module, storages: Storages, stage: str = "fragment", version: int = 330) -> tuple[str, Layout]:
    """Return the text of a fragment or compute shader and its layout.

    ``stage`` "compute" is for voxel entries and needs ``version`` 430 or more. ValueError: a wrong stage or storage.
    """
    if stage not in ("fragment", "compute"):
        raise ValueError(f"{stage!r} is no stage: use fragment or compute")
    if stage == "compute" and (module.entry != "voxel" or version < 430):
        raise ValueError("compute shaders are for voxel entries, in version 430 or later")
    return _GlslPrinter(module, storages).program_text(stage, version)


class _GlslPrinter(Printer):
    def program_text(self, stage: str, version: int) -> tuple[str, Layout]:
        entry = self.instance(Instance(self.module.entry, ()))
        prototypes, bodies = self.functions()
        constants = [self.constant(decl) for decl in self.program.constants]
        slots = self.slots()
        text = [f"#version {version}", self.line_directive(len(self.module.files), 1)]
        text += [self.struct(struct) for struct in self.program.structs]
        for symbol in self.program.uniforms:
            text.append(f"uniform {self.declared(symbol.type, symbol.printed)};")
        text += declarations(self, slots)
        text += list(self.helpers.values())
        text += constants
        text += list(self.accessors.values())
        text += prototypes
        text += self.with_places(bodies)
        text.append(self.line_directive(len(self.module.files), 1))
        text += self.main(entry, stage)
        layout = Layout(
            stage=stage,
            outputs=self.module.outputs,
            leaves=leaves(self.program.uniforms),
            slots=slots,
            files=self.module.files,
            slice="ng_slice" if stage == "fragment" and self.module.entry == "voxel" else "",
            origin="ng_origin" if stage == "compute" else "",
            extent="ng_extent" if stage == "compute" else "",
            group=GROUP if stage == "compute" else (1, 1, 1),
        )
        return "\n".join(text) + "\n", layout

    def slots(self) -> tuple[FieldSlot, ...]:
        found = []
        for number, symbol in enumerate(self.fields):
            for element, storage in enumerate(self.storages[symbol.name]):
                stem = FieldRef(number, element).stem
                found.append(
                    FieldSlot(
                        symbol.name,
                        element,
                        storage,
                        sampler=stem,
                        size=f"{stem}_size",
                        inverse=f"{stem}_inverse" if storage.filtered and not storage.sampler else "",
                        mapping=f"{stem}_mapping" if storage.mapped else "",
                    )
                )
        return tuple(found)

    def main(self, entry: str, stage: str) -> list[str]:
        outputs = self.module.outputs
        result = self.program.entry.type
        parts = ["r"]
        if isinstance(result, Struct):
            parts = [f"r.{mangle('m', name)}" for name, _ in result.members]
        text = []
        if stage == "compute":
            for i, output in enumerate(outputs):
                letter = output.type.base[0] if output.type.base != "float" else ""
                text.append(
                    f"layout(binding = {i}, {_IMAGES[str(output.type)]}) writeonly uniform {letter}image3D o{i};"
                )
            text.append("uniform ivec3 ng_origin;\nuniform ivec3 ng_extent;")
            text.append("layout(local_size_x = {}, local_size_y = {}, local_size_z = {}) in;".format(*GROUP))
            text.append("void main() {\n    ivec3 at = ivec3(gl_GlobalInvocationID) + ng_origin;")
            text.append("    if (any(greaterThanEqual(at, ng_extent))) return;")
            text.append(f"    {self.type(result)} r = {entry}(at);")
            for i, (output, part) in enumerate(zip(outputs, parts, strict=True)):
                wide = {"float": "vec4", "int": "ivec4", "uint": "uvec4"}[output.type.base]
                fill = {1: ", 0, 0, 0", 2: ", 0, 0", 4: ""}[output.type.n]
                text.append(f"    imageStore(o{i}, at, {wide}({part}{fill}));")
            return [*text, "}"]
        for i, output in enumerate(outputs):
            text.append(f"layout(location = {i}) out {output.type} o{i};")
        at = "ivec2(gl_FragCoord.xy)"
        if self.module.entry == "voxel":
            text.append("uniform int ng_slice;")
            at = f"ivec3({at}, ng_slice)"
        text.append(f"void main() {{\n    {self.type(result)} r = {entry}({at});")
        text += [f"    o{i} = {part};" for i, part in enumerate(parts)]
        return [*text, "}"]

    # Statements

    def print_while(self, stmt: s.While) -> None:
        if left_early(stmt.body):
            super().print_while(stmt)
        else:
            self.tested_at_its_end(stmt, self.expr(stmt.condition))

    def print_dowhile(self, stmt: s.DoWhile) -> None:
        if not left_early(stmt.body):
            self.tested_at_its_end(stmt, "true")
            return
        again = self.again()
        # The test as the step of a for loop, which ``continue`` reaches too.
        self.emit(stmt.line, f"for (bool {again} = true; {again}; {again} = {self.expr(stmt.condition)}) {{")
        self.inner(stmt.body)
        self.emit(0, "}")

    def tested_at_its_end(self, stmt: s.While | s.DoWhile, first: str) -> None:
        """Print a loop that llvmpipe (Mesa 22.3) does not go through once more after the last pixel has left it.

        What pixels that have left before compute meanwhile is seen behind a do loop there, so they do nothing.
        """
        again = self.again()
        self.emit(stmt.line, f"bool {again} = {bare(first)};")
        self.emit(0, f"do {{ if ({again}) {{")
        self.inner(stmt.body)
        self.emit(stmt.condition.line, f"    {again} = {bare(self.expr(stmt.condition))};")
        self.emit(0, f"}} }} while ({again});")

    def again(self) -> str:
        """A name for whether a pixel goes through a loop again."""
        self.loops += 1
        return f"ng_again{self.loops}"

    #: How many names it has made.
    loops = 0

    # Declarations and types

    def type(self, type: Type) -> str:
        if isinstance(type, Struct):
            return mangle("s", type.name)
        if isinstance(type, Array):
            return f"{self.type(type.element)}[{type.count}]"
        return str(type)

    def declared(self, type: Type, name: str) -> str:
        if isinstance(type, Array):
            return f"{self.type(type.element)} {name}[{type.count}]"
        return f"{self.type(type)} {name}"

    def struct(self, struct: Struct) -> str:
        members = " ".join(f"{self.declared(type, mangle('m', name))};" for name, type in struct.members)
        return f"struct {self.type(struct)} {{ {members} }};"

    def constant(self, decl: s.GlobalDecl) -> str:
        """A constant is a macro: GLSL's own constants cannot call our functions. Its name, k_NAME, is nobody else's."""
        assert decl.symbol is not None
        assert decl.value is not None
        name, value = decl.symbol.printed, decl.value
        if not isinstance(value, s.ArrayLiteral):
            return f"#define {name} ({self.expr(value)})"
        items = ", ".join(self.known(arg.constant, arg.type) for arg in value.args)
        return f"const {self.declared(value.type, name)} = {self.type(value.type)}({items});"

    def known(self, value: s.Constant | None, type: Type) -> str:
        """Return a folded number or vector."""
        assert value is not None
        assert isinstance(type, Numeric)
        if isinstance(value, tuple):
            return f"{type}({', '.join(self.known(part, Numeric(type.base)) for part in value)})"
        return literal(s.Literal(0, type.base, value))

    def zero(self, type: Type) -> str:
        if isinstance(type, Numeric):
            zero = {"float": "0.0", "int": "0", "uint": "0u", "bool": "false"}[type.base]
            return zero if type.n == 1 else f"{type}({zero})"
        if isinstance(type, Matrix):
            return f"{type}(0.0)"
        if isinstance(type, Struct):
            return f"{self.type(type)}({', '.join(self.zero(part) for _, part in type.members)})"
        assert isinstance(type, Array)
        return f"{self.type(type)}({', '.join([self.zero(type.element)] * type.count)})"

    def line_directive(self, file: int, line: int) -> str:
        return f"#line {line} {file}"

    # Expressions

    def expr(self, expr: s.Expr) -> str:
        if isinstance(expr, s.Literal):
            return literal(expr)
        if isinstance(expr, s.Name):
            assert expr.symbol is not None
            return expr.symbol.printed
        if isinstance(expr, s.Unary):
            return f"({expr.op}{self.expr(expr.operand)})"
        if isinstance(expr, s.Binary):
            return self.operation(expr.op, expr.left, expr.right)
        if isinstance(expr, s.Ternary):
            return f"({self.expr(expr.condition)} ? {self.expr(expr.yes)} : {self.expr(expr.no)})"
        if isinstance(expr, s.Index):
            return f"{self.expr(expr.base)}[{self.index(expr)}]"
        if isinstance(expr, s.Member):
            return f"{self.expr(expr.base)}.{expr.swizzle or mangle('m', expr.name)}"
        if isinstance(expr, s.ArrayLiteral):
            return f"{self.type(expr.type)}({', '.join(map(self.expr, expr.args))})"
        assert isinstance(expr, s.Call)
        if expr.target == "field":
            return self.field_call(expr)
        if expr.target == "function":
            return self.own_call(expr)
        if expr.target == "builtin":
            return self.builtin(expr)
        return f"{self.type(expr.type)}({', '.join(map(self.expr, expr.args))})"

    def target(self, expr: s.Expr) -> str:
        return self.expr(expr)

    def index(self, expr: s.Index) -> str:
        if isinstance(expr.index.constant, int):
            return str(expr.index.constant)
        base = expr.base.type
        assert isinstance(base, Array | Numeric | Matrix)
        last = (base.count if isinstance(base, Array) else base.n) - 1
        return f"clamp({self.expr(expr.index)}, 0, {last})"

    def operation(self, op: str, a: s.Expr, b: s.Expr) -> str:
        left, right = self.expr(a), self.expr(b)
        if op in ("/", "%") and is_int(a.type):
            return self.division(op, a, b, left, right)
        return f"({left} {op} {right})"

    def division(self, op: str, a: s.Expr, b: s.Expr, left: str, right: str) -> str:
        """Integer division never traps: x / 0 and x % 0 are 0, and % has the sign of its left side."""
        assert isinstance(a.type, Numeric)
        assert isinstance(b.type, Numeric)
        signed = a.type.base == "int"
        if divides_plainly(b) and not (signed and op == "%"):
            return f"({left} {op} {right})"
        if signed:
            self.helper("ng_idiv", prelude.IDIV)
            name = "ng_idiv" if op == "/" else self.helper("ng_imod", prelude.IMOD)
        else:
            name = self.helper("ng_udiv", prelude.UDIV) if op == "/" else self.helper("ng_umod", prelude.UMOD)
        n = max(a.type.n, b.type.n)
        if n == 1:
            return f"{name}({left}, {right})"
        T = Numeric(a.type.base, n)
        parts = ", ".join(f"{name}(a.{c}, b.{c})" for c in "xyzw"[:n])
        wide = self.helper(f"{name}{n}", f"{T} {name}{n}({T} a, {T} b) {{ return {T}({parts}); }}")
        return f"{wide}({T}({left}), {T}({right}))"

    def builtin(self, call: s.Call) -> str:
        args = [self.expr(arg) for arg in call.args]
        own = getattr(self, f"builtin_{call.name}", None)
        if own is not None:
            return str(own(call, args))
        return f"{call.name}({', '.join(args)})"

    def builtin_transform(self, call: s.Call, args: list[str]) -> str:
        return f"({args[0]} * {args[1]})"

    def builtin_round(self, call: s.Call, args: list[str]) -> str:
        return f"roundEven({args[0]})"

    def builtin_mix(self, call: s.Call, args: list[str]) -> str:
        if call.args[2].type == BOOL:
            return f"({args[2]} ? {args[1]} : {args[0]})"
        return f"mix({', '.join(args)})"

    def builtin_normalize(self, call: s.Call, args: list[str]) -> str:
        if call.type == FLOAT:
            self.helper("ng_normalize1", prelude.NORMALIZE_SCALAR)
        else:
            assert isinstance(call.type, Numeric)
            largest = "abs(v.x)"
            for letter in "yzw"[: call.type.n - 1]:
                largest = f"max({largest}, abs(v.{letter}))"
            text = prelude.NORMALIZE.format(T=call.type, largest=largest)
            self.helper(f"ng_normalize{call.type.n}", text)
        return f"ng_normalize({args[0]})"

    def builtin_isnan(self, call: s.Call, args: list[str]) -> str:
        return self.per_component("ng_isnan", prelude.ISNAN, call, args)

    def builtin_isinf(self, call: s.Call, args: list[str]) -> str:
        return self.per_component("ng_isinf", prelude.ISINF, call, args)

    def per_component(self, name: str, text: str, call: s.Call, args: list[str]) -> str:
        self.helper(name, text)
        assert isinstance(call.type, Numeric)
        n = call.type.n
        if n > 1:
            parts = ", ".join(f"{name}(x.{c})" for c in "xyzw"[:n])
            self.helper(f"{name}{n}", f"bvec{n} {name}(vec{n} x) {{ return bvec{n}({parts}); }}")
        return f"{name}({args[0]})"

    def builtin_expm1(self, call: s.Call, args: list[str]) -> str:
        return f"{self.helper('ng_expm1', prelude.EXPM1)}({args[0]})"

    def builtin_log1p(self, call: s.Call, args: list[str]) -> str:
        self.helper("ng_isnan", prelude.ISNAN)
        self.helper("ng_isinf", prelude.ISINF)
        return f"{self.helper('ng_log1p', prelude.LOG1P)}({args[0]})"

    def accessor(self, name: str, ref: FieldRef) -> str:
        return accessor_text(self, name, ref)


def literal(expr: s.Literal) -> str:
    """Return a literal that both GLSL and, but for floats, C understand."""
    if expr.kind == "float":
        return repr(float(expr.value))
    if expr.kind == "bool":
        return "true" if expr.value else "false"
    if expr.value == -0x80000000:
        return "(-2147483647 - 1)"  # its digits alone pass the largest int
    return f"{expr.value}u" if expr.kind == "uint" else str(expr.value)
