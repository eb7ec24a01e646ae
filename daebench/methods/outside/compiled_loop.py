"""The loop over the steps of a compiled library, in machine code: a function of C is called by its address."""

import contextlib
import ctypes
from functools import cache
from typing import Any

from daebench.systems.lazily import llvmlite


@cache
def loop(vectors: int) -> Any:
    """Return ``int run(step, par, vector..., length, h, rows, steps, count)``, for states of one vector or of two of the same length.

    It calls the function ``step(par, vector..., h)`` so many times, stores the vectors in a row after each call, and then the number of
    calls in ``count``. It ends at a status that is not 0, and returns it.
    """
    binding = llvmlite.binding
    binding.initialize_native_target()
    binding.initialize_native_asmprinter()
    with contextlib.suppress(RuntimeError):  # newer versions do it themselves, and refuse
        binding.initialize()
    parsed = binding.parse_assembly(str(_module(vectors)))
    parsed.verify()
    machine = binding.Target.from_default_triple().create_target_machine(opt=3)
    engine = binding.create_mcjit_compiler(parsed, machine)
    engine.finalize_object()
    engines.append(engine)
    of_state = [ctypes.c_void_p] * (2 + vectors)
    signature = [*of_state, ctypes.c_int64, ctypes.c_double, ctypes.c_void_p, ctypes.c_int64, ctypes.c_void_p]
    return ctypes.CFUNCTYPE(ctypes.c_int, *signature)(engine.get_function_address("run"))


engines: list[Any] = []
"""They have the machine code, as long as they exist."""


def _module(vectors: int) -> Any:
    ir = llvmlite.ir
    word, real, status = ir.IntType(64), ir.DoubleType(), ir.IntType(32)
    pointer, module = real.as_pointer(), ir.Module()
    of_step = ir.FunctionType(status, [pointer] * (1 + vectors) + [real]).as_pointer()
    arguments = [of_step, *[pointer] * (1 + vectors), word, real, pointer, word, word.as_pointer()]
    run = ir.Function(module, ir.FunctionType(status, arguments), "run")
    step, par, *state, length, h, rows, steps, count = run.args
    blocks = {name: run.append_basic_block(name) for name in ("entry", "head", "call", "store", "failed", "done")}
    build = ir.IRBuilder(blocks["entry"])
    build.branch(blocks["head"])
    build.position_at_end(blocks["head"])
    k = build.phi(word)
    k.add_incoming(ir.Constant(word, 0), blocks["entry"])
    build.cbranch(build.icmp_signed("<", k, steps), blocks["call"], blocks["done"])
    build.position_at_end(blocks["call"])
    result = build.call(step, [par, *state, h])
    build.cbranch(build.icmp_signed("==", result, ir.Constant(status, 0)), blocks["store"], blocks["failed"])
    build.position_at_end(blocks["store"])
    for place, vector in enumerate(state):
        first = build.mul(build.add(build.mul(k, ir.Constant(word, vectors)), ir.Constant(word, place)), length)
        _copy(build, vector, build.gep(rows, [first]), length)
    after = build.add(k, ir.Constant(word, 1))
    build.store(after, count)
    k.add_incoming(after, build.block)
    build.branch(blocks["head"])
    build.position_at_end(blocks["failed"])
    build.ret(result)
    build.position_at_end(blocks["done"])
    build.ret(ir.Constant(status, 0))
    return module


def _copy(build: Any, source: Any, target: Any, length: Any) -> None:
    """Copy at least one number after another."""
    before, again, after = build.block, build.append_basic_block("copy"), build.append_basic_block("copied")
    build.branch(again)
    build.position_at_end(again)
    ir = llvmlite.ir
    word = ir.IntType(64)
    i = build.phi(word)
    build.store(build.load(build.gep(source, [i])), build.gep(target, [i]))
    following = build.add(i, ir.Constant(word, 1))
    i.add_incoming(ir.Constant(word, 0), before)
    i.add_incoming(following, again)
    build.cbranch(build.icmp_signed("<", following, length), again, after)
    build.position_at_end(after)
