"""The types of _core.pyi are those of the module: every name, every parameter, in order."""

import ast
import inspect
import re
import unittest
from pathlib import Path

import dtr
from dtr import _core

STUBS = Path("python/dtr/_core.pyi")


def parameters_of_stub(function):
    names = [a.arg for a in function.args.args + function.args.kwonlyargs if a.arg != "self"]
    optional = len(function.args.defaults) + sum(d is not None for d in function.args.kw_defaults)
    return names, optional


def parameters_of_module(function):
    """Those of pybind11's first line: name(self: X, a: T, b: T = 1) -> R."""
    line = function.__doc__.splitlines()[0]
    inside = line[line.index("(") + 1 : line.rindex(") ->")]
    parts = re.findall(r"(?:^|, )(\w+): ((?:[^,=\[\]()]|\[[^\]]*(?:\[[^\]]*\])*[^\]]*\]|\([^)]*\))*)(=?)", inside)
    names = [name for name, _, _ in parts if name not in ("self", "arg0")]
    return names, sum(bool(default) for _, _, default in parts)


class Stubs(unittest.TestCase):
    def setUp(self):
        self.tree = ast.parse(STUBS.read_text())
        self.classes = {n.name: n for n in self.tree.body if isinstance(n, ast.ClassDef)}
        self.functions = {n.name: n for n in self.tree.body if isinstance(n, ast.FunctionDef)}

    def test_names_of_the_module(self):
        module = {n for n in dir(_core) if not n.startswith("__")}
        self.assertEqual(module, set(self.classes) | set(self.functions))

    def test_members_of_classes(self):
        for name, stub in self.classes.items():
            kind = getattr(_core, name)
            if issubclass(kind, Exception):
                continue
            written = {n.name for n in stub.body if isinstance(n, ast.FunctionDef)}
            written |= {n.target.id for n in stub.body if isinstance(n, ast.AnnAssign)}
            # pybind11 2.13 gives its classes a method for other modules, which is not part of ours.
            there = {n for n in vars(kind) if not n.startswith(("__", "_pybind11_"))}
            self.assertEqual(there | {"__init__"} if "__init__" in written else there, written, name)
            for member in stub.body:
                if not isinstance(member, ast.FunctionDef):
                    continue
                is_property = any(isinstance(d, ast.Name) and d.id == "property" for d in member.decorator_list)
                self.assertEqual(isinstance(vars(kind)[member.name], property), is_property, member.name)
                if not is_property:
                    with self.subTest(f"{name}.{member.name}"):
                        self.assertEqual(parameters_of_module(getattr(kind, member.name)),
                                         parameters_of_stub(member))

    def test_parameters_of_functions(self):
        for name, stub in self.functions.items():
            with self.subTest(name):
                self.assertEqual(parameters_of_module(getattr(_core, name)), parameters_of_stub(stub))

    def test_properties_cannot_be_set(self):
        for name in ("Camera", "View", "OpenSet"):
            for member, value in vars(getattr(_core, name)).items():
                if isinstance(value, property):
                    self.assertIsNone(value.fset, f"{name}.{member}")

    def test_everything_people_use_is_described(self):
        for name in dtr.__all__:
            thing = getattr(dtr, name)
            if name == "__version__":
                continue
            self.assertTrue(inspect.getdoc(thing), name)
            if not inspect.isclass(thing) or issubclass(thing, Exception):
                continue
            for member, value in vars(thing).items():
                if not member.startswith("_") and (callable(value) or isinstance(value, property)):
                    self.assertTrue(inspect.getdoc(value), f"{name}.{member}")

    def test_marked_as_typed(self):
        self.assertTrue((Path(dtr.__file__).parent / "py.typed").exists())
        self.assertTrue((Path(dtr.__file__).parent / "_core.pyi").exists())


if __name__ == "__main__":
    unittest.main()
