"""Loading compiled functions from numba's cache without what only compiling needs.

Before numba loads the first one it sets up its whole compiler, which takes half a second of CPU in each process,
whether anything has to be compiled or not. And of each function it reads, beside the machine code, the intermediate
code that others are linked with, which takes three times as long as the rest. Both wait here until something is
compiled.
"""

from __future__ import annotations

import contextlib
import importlib
import inspect
from functools import cache
from typing import Any

from scan2bim.absent import absent

KNOWN = ("0.68.",)
"""Versions of numba whose libraries of code work as is relied on here; others load all at once."""


@cache
def load_without_compiler() -> None:
    """Let numba load functions from its cache without setting up its compiler; that waits for the first that is not
    there. Does nothing where numba works otherwise than it is known to.
    """
    kept: Any = getattr(importlib.import_module("numba.core.caching"), "Cache", None)
    runtime: Any = getattr(importlib.import_module("numba.core.runtime"), "rtsys", None)
    load, usual = getattr(kept, "_load_overload", None), getattr(kept, "load_overload", None)
    known = ["self", "sig", "target_context"]
    if runtime is None or load is None or usual is None:
        return
    if any(list(inspect.signature(f).parameters) != known for f in (load, usual)):
        return
    if importlib.import_module("numba").__version__.startswith(KNOWN):
        _link_later()

    def load_overload(self: Any, sig: Any, target_context: Any) -> Any:
        with contextlib.suppress(Exception):  # whatever it is, the usual way does without
            runtime.initialize(target_context)
            with absent("scipy.linalg"):  # for products of matrices in compiled functions, of which there are none
                found = load(self, sig, target_context)
            if found is not None:
                return found
        return usual(self, sig, target_context)

    kept.load_overload = load_overload


def _link_later() -> None:
    """Let the intermediate code of functions from the cache be read when something is linked with it or asks for a
    symbol that is not known.
    """
    codegen: Any = importlib.import_module("numba.core.codegen")
    llvm: Any = importlib.import_module("llvmlite.binding")
    results: Any = importlib.import_module("numba.core.compiler").CompileResult
    library, engine = codegen.CPUCodeLibrary, codegen.JitEngine
    unserialize, rebuild = library._unserialize.__func__, results._rebuild.__func__
    linked, defined = library._get_module_for_linking, engine.is_symbol_defined
    unread: dict[Any, bytes] = {}

    def read(one: Any) -> None:
        if (code := unread.pop(one, None)) is not None:
            one._shared_module = llvm.parse_bitcode(code)
            one._codegen._engine._load_defined_symbols(one._shared_module)

    def _unserialize(cls: Any, context: Any, state: Any) -> Any:
        name, kind, data = state
        if kind != "object":
            return unserialize(cls, context, state)
        one = context.create_library(name)
        one.enable_object_caching()
        one._set_compiled_object(data[0])
        one._finalize_final_module()
        unread[one] = data[1]
        return one

    def _rebuild(cls: Any, target_context: Any, libdata: Any, fndesc: Any, *rest: Any) -> Any:
        target_context.codegen()._engine._defined_symbols.add(fndesc.llvm_cpython_wrapper_name)
        return rebuild(cls, target_context, libdata, fndesc, *rest)

    def _get_module_for_linking(self: Any) -> Any:
        read(self)
        return linked(self)

    def is_symbol_defined(self: Any, name: str) -> bool:
        if name not in self._defined_symbols:
            for one in list(unread):
                read(one)
        return bool(defined(self, name))

    library._unserialize, library._get_module_for_linking = classmethod(_unserialize), _get_module_for_linking
    results._rebuild, engine.is_symbol_defined = classmethod(_rebuild), is_symbol_defined
