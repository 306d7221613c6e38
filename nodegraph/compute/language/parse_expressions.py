"""The expression half of the parser: tokens, names, operators, calls."""

from __future__ import annotations

from nodegraph.errors import ShaderError
from nodegraph.shaders import Source

from . import syntax as s
from .lexer import Token
from .types import NAMED
from .words import KEYWORDS, NOT_IN_LANGUAGE

#: Deepest nesting of statements and expressions; keeps every later pass within Python's own recursion limit.
MAX_DEPTH = 64

_LEVELS: tuple[tuple[str, ...], ...] = (
    ("||",), ("^^",), ("&&",), ("|",), ("^",), ("&",), ("==", "!="), ("<", ">", "<=", ">="), ("<<", ">>"), ("+", "-"),
    ("*", "/", "%"),
)  # fmt: skip
_PRECEDENCE = {op: level for level, ops in enumerate(_LEVELS) for op in ops}


class ExpressionParser:
    """Reads expressions; knows which structs were declared so far."""

    def __init__(self, tokens: list[Token], source: Source) -> None:
        self.tokens = tokens
        self.source = source
        self.at = 0
        self.depth = 0
        self.structs: set[str] = set()

    # Tokens

    @property
    def token(self) -> Token:
        return self.tokens[self.at]

    def peek(self, ahead: int = 1) -> Token:
        return self.tokens[min(self.at + ahead, len(self.tokens) - 1)]

    def take(self) -> Token:
        token = self.token
        if token.kind != "end":
            self.at += 1
        return token

    def accept(self, text: str) -> bool:
        if self.token.text == text and self.token.kind in ("op", "name"):
            self.at += 1
            return True
        return False

    def expect(self, text: str) -> Token:
        if self.token.text != text or self.token.kind not in ("op", "name"):
            where = self.token
            if text == ";" and self.at and self.tokens[self.at - 1].line < where.line:
                where = self.tokens[self.at - 1]  # the line that lacks it, not the one where that shows
            raise self.fail(f"{text!r} is missing before {self.shown()}", where.line)
        return self.take()

    def shown(self) -> str:
        return "the end of the file" if self.token.kind == "end" else repr(self.token.text)

    def fail(self, message: str, line: int | None = None) -> ShaderError:
        return self.source.error(self.token.line if line is None else line, message)

    def enter(self) -> None:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise self.fail(f"nested more than {MAX_DEPTH} deep: use variables or functions")

    def refuse_word(self, token: Token) -> None:
        """Refuse what GLSL has and the language has not, with the cure."""
        if token.kind != "name":
            return
        cure = NOT_IN_LANGUAGE.get(token.text)
        if cure is None and token.text.startswith("gl_"):
            cure = "the kernel's position is the argument of its entry, and its result is what it returns"
        if cure is not None:
            raise self.fail(f"{token.text} is not in the language: {cure}", token.line)

    def new_name(self, what: str) -> Token:
        self.refuse_word(self.token)
        token = self.take()
        if token.kind != "name":
            raise self.fail(f"{what} needs a name here, not {token.text!r}", token.line)
        if token.text in KEYWORDS or token.text in NAMED:
            raise self.fail(f"{token.text} is a word of the language: choose another name for {what}", token.line)
        if "__" in token.text or len(token.text) > 200:
            raise self.fail(f"{token.text[:40]} is reserved: a name has no two underscores in a row", token.line)
        return token

    # Expressions

    def expression(self) -> s.Expr:
        self.enter()
        result = self.ternary()
        self.depth -= 1
        if self.token.text in ("++", "--") and self.peek().text not in (";", ")"):
            raise self.fail(f"{self.token.text} is a statement of its own, not part of an expression")
        return result

    def ternary(self) -> s.Expr:
        condition = self.binary(0)
        if self.token.text != "?":
            return condition
        line = self.take().line
        yes = self.expression()
        self.expect(":")
        no = self.expression()
        return self.deepen(s.Ternary(line, condition, yes, no), condition, yes, no)

    def deepen(self, node: s.Expr, *parts: s.Expr) -> s.Expr:
        """Limit the depth of the tree, which for ``a + b + c + ...`` grows without any nesting in the text."""
        node.depth = 1 + max((part.depth for part in parts), default=0)
        if node.depth > 2 * MAX_DEPTH:
            raise self.fail(f"this expression has more than {2 * MAX_DEPTH} steps: use variables", node.line)
        return node

    def binary(self, level: int) -> s.Expr:
        """Precedence climbing over ``_LEVELS``."""
        left = self.unary()
        while True:
            op = self.token.text
            own = _PRECEDENCE.get(op, -1) if self.token.kind == "op" else -1
            if own < level:
                return left
            line = self.take().line
            self.enter()
            right = self.binary(own + 1)
            self.depth -= 1
            left = self.deepen(s.Binary(line, op, left, right), left, right)

    def unary(self) -> s.Expr:
        token = self.token
        if token.kind == "op" and token.text in ("-", "+", "!", "~"):
            self.take()
            self.enter()
            operand = self.unary()
            self.depth -= 1
            return self.deepen(s.Unary(token.line, token.text, operand), operand)
        if token.text in ("++", "--"):
            raise self.fail(f"{token.text} is a statement of its own, not part of an expression")
        return self.postfix()

    def postfix(self) -> s.Expr:
        result = self.primary()
        while True:
            line = self.token.line
            if self.accept("["):
                index = self.expression()
                self.expect("]")
                result = self.deepen(s.Index(line, result, index), result, index)
            elif self.accept("."):
                name = self.take()
                if name.kind != "name":
                    raise self.fail(f"a member's name is missing after '.', before {name.text!r}", line)
                if self.token.text == "(":
                    raise self.fail(
                        f".{name.text}() is not in the language: the length of an array is a constant", line
                    )
                result = self.deepen(s.Member(line, result, name.text), result)
            else:
                return result

    def primary(self) -> s.Expr:
        self.refuse_word(self.token)
        token = self.take()
        line = token.line
        if token.kind in ("int", "uint"):
            return s.Literal(line, token.kind, int(token.text, 0))
        if token.kind == "float":
            return s.Literal(line, "float", float(token.text))
        if token.kind == "bool":
            return s.Literal(line, "bool", token.text == "true")
        if token.text == "(":
            inside = self.expression()
            if self.token.text == ",":
                raise self.fail("the comma operator is not in the language")
            self.expect(")")
            return inside
        is_type = token.text in NAMED or token.text in self.structs
        if token.kind == "name" and (is_type or token.text not in KEYWORDS):
            if is_type and self.token.text == "[":
                return self.array_literal(token)
            if self.token.text == "(":
                return self.call(token)
            if is_type:
                raise self.fail(f"{token.text} is a type, and a value is needed here", line)
            return s.Name(line, token.text)
        shown = "the end of the file" if token.kind == "end" else repr(token.text)
        raise self.fail(f"an expression is needed before {shown}", line)

    def arguments(self) -> list[s.Expr]:
        self.expect("(")
        args: list[s.Expr] = []
        if self.token.text == "void" and self.peek().text == ")":
            self.take()
        while not self.accept(")"):
            if args:
                self.expect(",")
            args.append(self.expression())
        return args

    def call(self, token: Token) -> s.Expr:
        args = self.arguments()
        return self.deepen(s.Call(token.line, token.text, args), *args)

    def array_literal(self, token: Token) -> s.Expr:
        self.expect("[")
        count = None if self.token.text == "]" else self.expression()
        self.expect("]")
        args = self.arguments()
        return self.deepen(s.ArrayLiteral(token.line, token.text, count, args), *args)
