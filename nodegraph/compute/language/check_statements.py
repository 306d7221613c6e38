"""Check the bodies of functions."""

from __future__ import annotations

from nodegraph.shaders import Source

from . import syntax as s
from .check_expressions import ExpressionChecker, a
from .names import mangle
from .types import Array, Field, Matrix, Numeric, Struct, Type, Void


class StatementChecker(ExpressionChecker):
    """Checks one function after the other."""

    def __init__(self, source: Source) -> None:
        super().__init__(source)
        self.loops = 0
        self.printed: set[str] = set()

    def body(self, function: s.Function) -> None:
        """Check a function whose head is known."""
        self.function = function
        self.printed = set()
        scope: dict[str, s.Symbol] = {}
        self.scopes = [scope]
        for parameter in function.parameters:
            assert parameter.symbol is not None
            parameter.symbol.printed = self.unique(parameter.name)
            scope[parameter.name] = parameter.symbol
        for stmt in function.body.body:
            self.statement(stmt)
        if not always_returns(function.body):
            raise self.fail(function.line, f"{function.name} can end without a value: end it with return")
        self.scopes = []
        self.function = None

    def unique(self, name: str) -> str:
        """Return a printed name that is new in this function, so that shadowing means the same in every language."""
        printed, count = mangle("a", name), 0
        while printed in self.printed:
            count += 1
            printed = mangle(f"a{count}", name)
        self.printed.add(printed)
        return printed

    def statement(self, stmt: s.Stmt) -> None:
        getattr(self, f"check_{type(stmt).__name__.lower()}")(stmt)

    def inner(self, *parts: s.Stmt) -> None:
        """Check statements in a scope of their own."""
        self.scopes.append({})
        for part in parts:
            self.statement(part)
        self.scopes.pop()

    def check_block(self, stmt: s.Block) -> None:
        self.inner(*stmt.body)

    def check_declare(self, stmt: s.Declare) -> None:
        if stmt.value is not None:
            self.value(stmt.value)
        type = self.resolve(stmt.written, stmt.value)
        if isinstance(type, Field):
            raise self.fail(stmt.line, "a field is declared outside functions, or is a parameter")
        if isinstance(type, Void):
            raise self.fail(stmt.line, "a variable has a type other than void")
        if stmt.value is not None and stmt.value.type != type:
            self.mismatch(stmt.value, type, stmt.name)
        if stmt.const and stmt.value is None:
            raise self.fail(stmt.line, f"the const {stmt.name} needs a value")
        if stmt.name in self.scopes[-1]:
            raise self.fail(stmt.line, f"{stmt.name} is declared twice in one block")
        symbol = s.Symbol("local", stmt.name, type, stmt.line, self.unique(stmt.name), writable=not stmt.const)
        if stmt.const and stmt.value is not None:
            symbol.constant = stmt.value.constant
        stmt.symbol = symbol
        self.scopes[-1][stmt.name] = symbol

    def check_assign(self, stmt: s.Assign) -> None:
        target = self.target(stmt.target)
        if stmt.op in ("++", "--"):
            if not isinstance(target, Numeric) or target.base == "bool":
                raise self.fail(stmt.line, f"{stmt.op} does not count {a(target)}")
            stmt.op = {"++": "+=", "--": "-="}[stmt.op]
            one: dict[str, float | int] = {"float": 1.0}
            stmt.value = s.Literal(stmt.line, target.base, one.get(target.base, 1))
        value = self.value(stmt.value)
        if stmt.op == "=":
            if value != target:
                self.mismatch(stmt.value, target, "the target")
            return
        if isinstance(target, Matrix) or isinstance(value, Matrix):
            raise self.fail(stmt.line, "matrices have no operators here: write transform(m, v)")
        if not isinstance(target, Numeric) or not isinstance(value, Numeric):
            raise self.fail(stmt.line, f"{stmt.op} takes numbers, not {a(target)} and {a(value)}")
        result = self.operation(stmt.line, stmt.op[:-1], target, value, stmt.target, stmt.value)
        if result != target:
            raise self.fail(stmt.line, f"{stmt.op} gives {a(result)}, and its target is {a(target)}")

    def target(self, expr: s.Expr) -> Type:
        """Type the left side of an assignment, and refuse what cannot be written."""
        type = self.check(expr)
        root: s.Expr = expr
        while isinstance(root, s.Member | s.Index):
            inside = root.base
            if isinstance(root, s.Member) and len(set(root.swizzle)) < len(root.swizzle):
                raise self.fail(root.line, f".{root.name} names a component twice and cannot be assigned")
            if isinstance(inside, s.Member) and inside.swizzle and isinstance(inside.type, Numeric):
                raise self.fail(root.line, "assign to one swizzle at a time")
            root = inside
        if not isinstance(root, s.Name) or root.symbol is None:
            raise self.fail(expr.line, "only a variable can be assigned")
        if not root.symbol.writable:
            what = {"local": "const", "parameter": "field"}.get(root.symbol.kind, root.symbol.kind)
            raise self.fail(expr.line, f"{root.name} is a {what} and cannot be assigned: copy it to a variable")
        return type

    def check_evaluate(self, stmt: s.Evaluate) -> None:
        self.check(stmt.value)
        raise self.fail(stmt.line, "this statement has no effect: functions only return values")

    def check_if(self, stmt: s.If) -> None:
        self.condition(stmt.condition, "if")
        self.inner(stmt.yes)
        if stmt.no is not None:
            self.inner(stmt.no)

    def check_for(self, stmt: s.For) -> None:
        self.scopes.append({})
        for part in stmt.start:
            self.statement(part)
        if stmt.condition is not None:
            self.condition(stmt.condition, "for")
        for part in stmt.step:
            self.statement(part)
        self.loop(stmt.body)
        self.scopes.pop()

    def loop(self, body: s.Stmt) -> None:
        self.loops += 1
        self.inner(body)
        self.loops -= 1

    def check_while(self, stmt: s.While) -> None:
        self.condition(stmt.condition, "while")
        self.loop(stmt.body)

    def check_dowhile(self, stmt: s.DoWhile) -> None:
        self.loop(stmt.body)
        self.condition(stmt.condition, "while")

    def check_jump(self, stmt: s.Jump) -> None:
        if not self.loops:
            raise self.fail(stmt.line, f"{stmt.word} outside a loop")

    def check_return(self, stmt: s.Return) -> None:
        assert self.function is not None
        if stmt.value is None:
            raise self.fail(stmt.line, f"{self.function.name} returns {a(self.function.type)}: write return value;")
        if self.value(stmt.value) != self.function.type:
            self.mismatch(stmt.value, self.function.type, f"the result of {self.function.name}")


def always_returns(stmt: s.Stmt | None) -> bool:
    """Can control never reach the end of this statement?"""
    if isinstance(stmt, s.Return):
        return True
    if isinstance(stmt, s.Block):
        return any(always_returns(part) for part in stmt.body)
    if isinstance(stmt, s.If):
        return always_returns(stmt.yes) and always_returns(stmt.no)
    if isinstance(stmt, s.For | s.While | s.DoWhile):
        endless = stmt.condition is None or stmt.condition.constant is True
        return endless and not _breaks(stmt.body)
    return False


def _breaks(stmt: s.Stmt | None) -> bool:
    """Does a statement of a loop's body leave that loop?"""
    if isinstance(stmt, s.Jump):
        return stmt.word == "break"
    if isinstance(stmt, s.Block):
        return any(_breaks(part) for part in stmt.body)
    if isinstance(stmt, s.If):
        return _breaks(stmt.yes) or _breaks(stmt.no)
    return False


def left_early(stmt: s.Stmt | None, nested: bool = False) -> bool:
    """Is a turn of the loop that has this body ended early somewhere, by a jump of its own or by a return?"""
    if isinstance(stmt, s.Return):
        return True
    if isinstance(stmt, s.Jump):
        return not nested
    if isinstance(stmt, s.Block):
        return any(left_early(part, nested) for part in stmt.body)
    if isinstance(stmt, s.If):
        return left_early(stmt.yes, nested) or left_early(stmt.no, nested)
    if isinstance(stmt, s.For | s.While | s.DoWhile):
        return left_early(stmt.body, True)
    return False


def is_plain(type: Type) -> bool:
    """May a uniform, or a member of a struct, have this type?"""
    if isinstance(type, Array):
        return is_plain(type.element)
    if isinstance(type, Numeric):
        return type.base != "bool" or type.n == 1
    return isinstance(type, Matrix | Struct)
