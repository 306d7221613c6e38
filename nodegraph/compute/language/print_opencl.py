"""Print a checked kernel as OpenCL C, in single or double precision."""

from __future__ import annotations

from . import syntax as s
from .calls_opencl import CallPrinter
from .fields_opencl import accessor_text, parameter
from .module import FieldSlot, Layout, Module
from .names import mangle
from .prelude_opencl import COMPONENT, start
from .printing import FieldRef, Instance, Storages
from .types import Array, Matrix, Numeric, Struct, Type
from .uniform_leaves import leaves, sizes

KERNEL = "ng_kernel"
_BLOCKS = ("__constant const real *reals", "__constant const int *ints")


def print_opencl(module: Module, storages: Storages, real: str = "float") -> tuple[str, Layout]:
    """Return the text of an OpenCL C 1.2 program and its layout. ``real`` is float or double."""
    if real not in ("float", "double"):
        raise ValueError(f"{real!r} is no real type: use float or double")
    return _OpenclPrinter(module, storages, real).program_text()


class _OpenclPrinter(CallPrinter):
    function_prefix = "static "

    def __init__(self, module: Module, storages: Storages, real: str) -> None:
        super().__init__(module, storages)
        self.real = real
        self.slots, self.field_reals, self.field_ints = self.field_slots()
        self.leaves = leaves(self.program.uniforms, self.field_reals, self.field_ints)
        self.offsets: dict[str, tuple[int, int]] = {}
        at = (self.field_reals, self.field_ints)
        for symbol in self.program.uniforms:
            self.offsets[symbol.name] = at
            reals, ints = sizes(symbol.type)
            at = (at[0] + reals, at[1] + ints)
        self.total = at
        buffers = tuple(parameter(self.storage(FieldRef(self.number(slot), slot.element)), slot) for slot in self.slots)
        self.context_parameters = (*_BLOCKS, *buffers)
        self.context_arguments = ("reals", "ints", *(slot.sampler for slot in self.slots))

    def number(self, slot: FieldSlot) -> int:
        return [symbol.name for symbol in self.fields].index(slot.field)

    def field_slots(self) -> tuple[tuple[FieldSlot, ...], int, int]:
        """Place every field: its argument, and its size and mapping at the start of the two blocks."""
        found: list[FieldSlot] = []
        reals = ints = 0
        for number, symbol in enumerate(self.fields):
            for element, storage in enumerate(self.storages[symbol.name]):
                ref = FieldRef(number, element)
                found.append(
                    FieldSlot(
                        symbol.name,
                        element,
                        storage,
                        sampler=ref.stem,
                        argument=len(self.module.outputs) + len(found),
                        size_offset=ints,
                        mapping_offset=reals if storage.mapped else -1,
                    )
                )
                ints += self.axes(ref)
                reals += 2 if storage.mapped else 0
        return tuple(found), reals, ints

    def program_text(self) -> tuple[str, Layout]:
        entry = self.instance(Instance(self.module.entry, ()))
        prototypes, bodies = self.functions()
        constants = [self.constant(decl) for decl in self.program.constants]
        kernel, arguments = self.kernel(entry)
        self.types()
        text = [f'#line 1 "translated"\n{start(self.real)}', *self.declared.values(), *self.helpers.values()]
        text += [*constants, *self.accessors.values(), *prototypes]
        text += [*self.with_places(bodies), '#line 1 "translated"', kernel]
        layout = Layout(
            stage="opencl",
            outputs=self.module.outputs,
            leaves=self.leaves,
            slots=self.slots,
            files=self.module.files,
            kernel=KERNEL,
            arguments=arguments,
            reals=max(self.total[0], 1),
            ints=max(self.total[1], 1),
        )
        return "\n".join(text) + "\n", layout

    def types(self) -> None:
        """Declare every struct, used or not, so that their order is the author's."""
        for struct in self.program.structs:
            self.type(struct)

    def kernel(self, entry: str) -> tuple[str, tuple[str, ...]]:
        outputs = self.module.outputs
        result = self.program.entry.type
        members = [mangle("m", name) for name, _ in result.members] if isinstance(result, Struct) else []
        parameters, names, stores = [], [], []
        for i, output in enumerate(outputs):
            scalar = {"float": "real"}.get(output.type.base, output.type.base)
            parameters.append(f"__global {scalar} *restrict o{i}")
            names.append(f"output {output.name}".strip())
            value = f"r.{members[i]}" if members else "r"
            n = output.type.n
            stores.append(f"    o{i}[at] = {value};" if n == 1 else f"    vstore{n}({value}, at, o{i});")
        parameters += [*self.context_parameters[2:], *_BLOCKS, "const int width", "const int height", "const int depth"]
        names += [*(f"field {slot.field}[{slot.element}]" for slot in self.slots), "reals", "ints"]
        voxel = self.module.entry == "voxel"
        z = "(int)get_global_id(2)" if voxel else "0"
        lines = [
            f"__kernel void {KERNEL}({', '.join(parameters)}) {{",
            f"    const int x = (int)get_global_id(0), y = (int)get_global_id(1), z = {z};",
            "    if (x >= width || y >= height || z >= depth) return;",
            "    const size_t at = ((size_t)z * height + y) * width + x;",
            f"    const {self.type(result)} r = "
            f"{entry}({', '.join(self.context_arguments)}, {'(int3)(x, y, z)' if voxel else '(int2)(x, y)'});",
            *stores,
            "}",
        ]
        return "\n".join(lines), (*names, "width", "height", "depth")

    def line_directive(self, file: int, line: int) -> str:
        name = self.module.files[file].replace("\\", "/").replace('"', "'")
        return f'#line {line} "{name}"'

    # Declarations and types

    def constant(self, decl: s.GlobalDecl) -> str:
        """A constant is a macro: its name is its own (k_NAME), so nothing else is replaced. Arrays are program data."""
        assert decl.symbol is not None
        assert decl.value is not None
        name, value = decl.symbol.printed, decl.value
        if not isinstance(value, s.ArrayLiteral):
            return f"#define {name} ({self.expr(value)})"
        items = ", ".join(self.known(arg.constant, arg.type) for arg in value.args)
        return f"__constant {self.type(value.type)} {name} = {{{{{items}}}}};"

    def known(self, value: s.Constant | None, type: Type) -> str:
        """Return a folded number or vector."""
        assert value is not None
        assert isinstance(type, Numeric)
        if isinstance(value, tuple):
            return f"({self.type(type)})({', '.join(self.known(part, Numeric(type.base)) for part in value)})"
        return self.literal(s.Literal(0, type.base, value))

    def zero(self, type: Type) -> str:
        if isinstance(type, Numeric):
            return "0" if type.n == 1 else f"({self.type(type)})(0)"
        return f"({self.type(type)}){{{self.zero_inside(type)}}}"

    def zero_inside(self, type: Type) -> str:
        """C fills what is left with zeros; the first member decides how deep the braces go."""
        if isinstance(type, Numeric):
            return self.zero(type)
        if isinstance(type, Struct):
            first = type.members[0][1]
            inside = self.zero_inside(first)
            return inside if isinstance(first, Numeric) else f"{{{inside}}}"
        if isinstance(type, Matrix):
            return f"{{(real{type.n})(0)}}"
        assert isinstance(type, Array)
        inside = self.zero_inside(type.element)
        return f"{{{inside}}}" if isinstance(type.element, Numeric) else f"{{{{{inside}}}}}"

    # Expressions

    def expr(self, expr: s.Expr) -> str:
        loaded = self.uniform(expr)
        if loaded is not None:
            return loaded
        if isinstance(expr, s.Literal):
            return self.literal(expr)
        if isinstance(expr, s.Name):
            assert expr.symbol is not None
            return expr.symbol.printed
        if isinstance(expr, s.Unary):
            if expr.op == "!":
                return f"(!{self.expr(expr.operand)})"
            return f"({expr.op}{self.expr(expr.operand)})"
        if isinstance(expr, s.Binary):
            return self.operation(expr.op, expr.left, expr.right)
        if isinstance(expr, s.Ternary):
            return f"({self.expr(expr.condition)} ? {self.expr(expr.yes)} : {self.expr(expr.no)})"
        if isinstance(expr, s.Index):
            return self.indexed(expr, self.expr(expr.base))
        if isinstance(expr, s.Member):
            return f"{self.expr(expr.base)}.{expr.swizzle or mangle('m', expr.name)}"
        if isinstance(expr, s.ArrayLiteral):
            return f"(({self.type(expr.type)}){{{{{', '.join(map(self.expr, expr.args))}}}}})"
        assert isinstance(expr, s.Call)
        return self.call(expr)

    def indexed(self, expr: s.Index, base: str) -> str:
        """Return one element of an array, column of a matrix, or component of a vector, as a value."""
        type = expr.base.type
        at = expr.index.constant
        if isinstance(type, Numeric):
            if isinstance(at, int):
                return f"{base}.{'xyzw'[at]}"
            name = f"ng_at_{self.type(type)}"
            scalar = self.type(Numeric(type.base))
            self.helper(name, COMPONENT[type.n].format(S=scalar, T=self.type(type), name=name))
            return f"{name}({base}, {self.expr(expr.index)})"
        return f"{base}.{'a' if isinstance(type, Array) else 'c'}[{self.place(expr)}]"

    def place(self, expr: s.Index) -> str:
        """Return the text of an index, clamped to what it indexes."""
        if isinstance(expr.index.constant, int):
            return str(expr.index.constant)
        type = expr.base.type
        assert isinstance(type, Array | Matrix | Numeric)
        last = (type.count if isinstance(type, Array) else type.n) - 1
        return f"clamp({self.expr(expr.index)}, 0, {last})"

    def target(self, expr: s.Expr) -> str:
        if isinstance(expr, s.Name):
            return self.expr(expr)
        if isinstance(expr, s.Member):
            return f"{self.target(expr.base)}.{expr.swizzle or mangle('m', expr.name)}"
        assert isinstance(expr, s.Index)
        type, base = expr.base.type, self.target(expr.base)
        if isinstance(type, Numeric) and not isinstance(expr.index.constant, int):
            return f"(({self.type(Numeric(type.base))} *)&{base})[{self.place(expr)}]"
        return self.indexed(expr, base)

    def accessor(self, name: str, ref: FieldRef) -> str:
        return accessor_text(self, name, ref)

    # Uniforms

    def uniform(self, expr: s.Expr) -> str | None:
        """Return the load of a uniform, of a member or of an element of it; None for any other expression."""
        found = self.uniform_place(expr)
        if found is None:
            return None
        reals, ints = (" + ".join(part for part in parts if part != "0") or "0" for parts in found)
        return self.load(expr.type, reals, ints)

    def uniform_place(self, expr: s.Expr) -> tuple[list[str], list[str]] | None:
        """Return where a uniform lies in both blocks, as sums."""
        if isinstance(expr, s.Name):
            if expr.symbol is None or expr.symbol.kind != "uniform":
                return None
            reals, ints = self.offsets[expr.symbol.name]
            return [str(reals)], [str(ints)]
        if isinstance(expr, s.Member) and isinstance(expr.base.type, Struct):
            base = self.uniform_place(expr.base)
            if base is None:
                return None
            before = [0, 0]
            for name, type in expr.base.type.members:
                if name == expr.name:
                    break
                size = sizes(type)
                before = [before[0] + size[0], before[1] + size[1]]
            return [*base[0], str(before[0])], [*base[1], str(before[1])]
        if isinstance(expr, s.Index) and isinstance(expr.base.type, Array):
            base = self.uniform_place(expr.base)
            if base is None:
                return None
            stride = sizes(expr.base.type.element)
            at = expr.index.constant
            if isinstance(at, int):
                return [*base[0], str(at * stride[0])], [*base[1], str(at * stride[1])]
            place = self.place(expr)
            terms = [f"{place} * {step}" if step else "0" for step in stride]
            return [*base[0], terms[0]], [*base[1], terms[1]]
        return None

    def load(self, type: Type, reals: str, ints: str) -> str:
        """Return the text that reads a value out of the blocks."""
        if isinstance(type, Numeric):
            block, at = ("reals", reals) if type.base == "float" else ("ints", ints)
            if type.n == 1:
                value = f"{block}[{at}]"
                return (
                    f"({value} != 0)" if type.base == "bool" else f"as_uint({value})" if type.base == "uint" else value
                )
            value = f"vload{type.n}(0, {block} + {at})"
            return f"as_uint{type.n}({value})" if type.base == "uint" else value
        name = f"ng_load_{self.type(type)}"
        if name not in self.helpers:
            body = self.loader(type)
            self.helper(name, f"static {self.type(type)} {name}({', '.join(_BLOCKS)}) {{\n{body}    return r;\n}}")
        return f"{name}(reals + {reals}, ints + {ints})"

    def loader(self, type: Type) -> str:
        """Return statements that fill ``r`` from the blocks."""
        text = f"    {self.type(type)} r;\n"
        if isinstance(type, Struct):
            reals = ints = 0
            for member, part in type.members:
                text += f"    r.{mangle('m', member)} = {self.load(part, str(reals), str(ints))};\n"
                size = sizes(part)
                reals, ints = reals + size[0], ints + size[1]
            return text
        assert isinstance(type, Matrix | Array)
        element: Type = Numeric("float", type.n) if isinstance(type, Matrix) else type.element
        count, letter = (type.n, "c") if isinstance(type, Matrix) else (type.count, "a")
        stride = sizes(element)
        value = self.load(element, f"i * {stride[0]}", f"i * {stride[1]}")
        return f"{text}    for (int i = 0; i < {count}; i++) r.{letter}[i] = {value};\n"
