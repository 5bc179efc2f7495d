"""The prose of a file, line by line: Markdown without its code, comments and docstrings of source files, whole texts otherwise."""

import io
import re
import tokenize

CODE_SPAN = re.compile(r"(`+)(?:(?!\1).)+?\1")
LINK_TARGET = re.compile(r"\]\([^)]*\)")
C_COMMENT = re.compile(r'"(?:\\.|[^"\\\n])*"|//[^\n]*|/\*.*?\*/', re.S)
SOURCES = {".h", ".hpp", ".c", ".cpp", ".cc", ".in"}


def markdown(text):
    """Lines outside fenced blocks, without code spans and link targets."""
    fenced = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
        elif not fenced:
            yield number, LINK_TARGET.sub("]", CODE_SPAN.sub("`", line))


def python(text):
    """Comments, and strings that are statements of their own (docstrings)."""
    start_of_statement = True
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT or (token.type == tokenize.STRING and start_of_statement):
            for offset, line in enumerate(token.string.splitlines()):
                yield token.start[0] + offset, line
        start_of_statement = token.type in (tokenize.NEWLINE, tokenize.NL, tokenize.INDENT, tokenize.DEDENT, tokenize.COMMENT,
                                            tokenize.ENCODING)


def c_family(text):
    for found in C_COMMENT.finditer(text):
        if not found[0].startswith('"'):
            first = text.count("\n", 0, found.start()) + 1
            for offset, line in enumerate(found[0].splitlines()):
                yield first + offset, line


def script(text):
    """Comments of CMake files and shell scripts."""
    for number, line in enumerate(text.splitlines(), 1):
        if comment := re.search(r"(?:^|\s)#(.*)", line):
            yield number, comment[1]


def lines_of(file, text):
    """(line number, prose) of `text`, the content of `file`."""
    if file.suffix == ".md":
        return markdown(text)
    if file.suffix == ".py":
        return python(text)
    if file.suffix in SOURCES:
        return c_family(text)
    if file.suffix == ".cmake" or file.name == "CMakeLists.txt":
        return script(text)
    return enumerate(text.splitlines(), 1)
