"""The stub says what the module is: every name, every argument, every default."""

import ast
import inspect
from pathlib import Path

import truegrind
from truegrind import _truegrind

STUB = ast.parse((Path(truegrind.__file__).parent / "_truegrind.pyi").read_text(encoding="utf-8"))
# What Python itself gives every class.
USUAL = set(dir(object)) | {"__module__", "__init_subclass__", "__subclasshook__"}


def stubbed(node: ast.FunctionDef) -> list[tuple[str, str, str | None]]:
    """Name, kind and default of each argument; a default of `...` is any."""
    arguments = node.args
    out = []
    plain = arguments.posonlyargs + arguments.args
    defaults = [None] * (len(plain) - len(arguments.defaults)) + list(arguments.defaults)
    for argument, default in zip(plain, defaults):
        out.append((argument.arg, "plain", default and ast.unparse(default)))
    for argument, default in zip(arguments.kwonlyargs, arguments.kw_defaults):
        out.append((argument.arg, "keyword", default and ast.unparse(default)))
    return [entry for entry in out if entry[0] not in ("self", "cls")]


def found(function: object) -> list[tuple[str, str, str | None]]:
    kinds = {
        inspect.Parameter.KEYWORD_ONLY: "keyword",
        inspect.Parameter.POSITIONAL_OR_KEYWORD: "plain",
        inspect.Parameter.POSITIONAL_ONLY: "plain",
    }
    out = []
    for name, parameter in inspect.signature(function).parameters.items():
        default = None if parameter.default is parameter.empty else parameter.default
        default = "..." if default is ... else repr(default) if parameter.default is not parameter.empty else None
        out.append((name, kinds[parameter.kind], default))
    return [entry for entry in out if entry[0] not in ("self", "cls")]


def compare(where: str, node: ast.FunctionDef, function: object) -> None:
    ours, theirs = stubbed(node), found(function)
    assert [(name, kind) for name, kind, _ in ours] == [(name, kind) for name, kind, _ in theirs], where
    for (name, _, ours_default), (_, _, theirs_default) in zip(ours, theirs):
        either = "..." in (ours_default, theirs_default)
        alike = either or (ours_default is None) == (theirs_default is None)
        if alike and not either and ours_default is not None:
            alike = ast.literal_eval(ours_default) == ast.literal_eval(theirs_default)
        assert alike, f"{where}: {name} = {ours_default} in the stub, {theirs_default} in the module"


def test_the_stub_is_the_module():
    functions = {node.name: node for node in STUB.body if isinstance(node, ast.FunctionDef)}
    classes = {node.name: node for node in STUB.body if isinstance(node, ast.ClassDef)}
    there = {name for name in dir(_truegrind) if not name.startswith("__")}
    assert there == set(functions) | set(classes)
    for name, node in functions.items():
        compare(name, node, getattr(_truegrind, name))
    for name, node in classes.items():
        methods = {item.name: item for item in node.body if isinstance(item, ast.FunctionDef)}
        own = set(vars(getattr(_truegrind, name))) - USUAL - {"__repr__", "__doc__"}
        assert own == set(methods) - {"__new__"}, name
        for method, item in methods.items():
            value = getattr(getattr(_truegrind, name), method)
            is_property = any(isinstance(d, ast.Name) and d.id == "property" for d in item.decorator_list)
            assert is_property == inspect.isgetsetdescriptor(value), f"{name}.{method}"
            if not is_property and not method.startswith("__"):
                compare(f"{name}.{method}", item, value)


def test_everything_is_exported_and_explained():
    for name in truegrind.__all__:
        value = getattr(truegrind, name)
        assert isinstance(value, str) or (value.__doc__ or "").strip(), f"{name} has no documentation"
    public = {name for name in dir(_truegrind) if not name.startswith("_")}
    assert public <= set(truegrind.__all__)
    for name in public:
        value = getattr(_truegrind, name)
        if inspect.isclass(value):
            assert value.__module__ == "truegrind", name
            for member, kind in vars(value).items():
                if not member.startswith("_"):
                    assert (getattr(value, member).__doc__ or "").strip(), f"{name}.{member}"
