"""Machine code of this computer, made of text of LLVM, and object files of it loaded into this process."""

import ctypes
import ctypes.util
import sys
from functools import cache
from threading import Lock
from typing import Any

import llvmlite
import llvmlite.binding as llvm

SPEED = 2
"""Level of optimisation: the third takes longer to compile, and is not faster here."""

_LOCK = Lock()
"""LLVM's own data are for one thread at a time."""


def processor() -> tuple[str, str]:
    """Return the name of this processor, and what it can do."""
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


@cache
def machine() -> str:
    """Return all on which machine code depends: the processor with what it can do, the platform, LLVM."""
    version = ".".join(map(str, llvm.llvm_version_info))
    return " ".join([llvm.get_process_triple(), *processor(), sys.byteorder, f"LLVM {version} llvmlite {llvmlite.__version__}"])


def _target() -> Any:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    (cpu, features), target = processor(), llvm.Target.from_triple(llvm.get_process_triple())
    return target.create_target_machine(cpu=cpu, features=features, opt=SPEED, reloc="pic", codemodel="small")


def object_file(text: str, *, loops: bool) -> bytes:
    """Return the object file of a module of LLVM."""
    with _LOCK:
        module, target = llvm.parse_assembly(text), _target()
        module.triple, module.data_layout = llvm.get_process_triple(), str(target.target_data)
        options = llvm.create_pipeline_tuning_options(SPEED)
        options.slp_vectorization = False
        options.loop_vectorization = options.loop_unrolling = loops
        builder = llvm.create_pass_builder(target, options)
        builder.getModulePassManager().run(module, builder)
        return bytes(target.emit_object(module))


@cache
def session() -> Any:
    """Return the just-in-time compiler of LLVM that loads object files into this process."""
    # The older of LLVM's two linkers gives the sections of a file places of their own, and aborts where two are 2 GiB apart.
    return llvm.create_lljit_compiler(_target(), use_jit_link=sys.platform == "linux")


_loaded: list[Any] = []
"""What keeps loaded code in memory."""


def loaded(name: str, content: bytes, symbol: str) -> int:
    """Return the address of a function of an object file."""
    with _LOCK:
        library = llvm.JITLibraryBuilder().add_object_img(content).export_symbol(symbol)
        for function, address in _platform().items():
            library = library.import_symbol(function, address)
        tracker = library.link(session(), name)
        _loaded.append(tracker)
        return int(tracker[symbol])


_NAMES = """
sin cos sincos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp exp2 expm1 log log1p log2 log10 pow cbrt hypot fmod
"""
FUNCTIONS = tuple(_NAMES.split())
"""Functions of C on doubles that machine code may call; those on floats have an f behind their names."""


@cache
def _platform() -> dict[str, int]:
    """Return the addresses of functions of the platform."""
    mathematics = ctypes.CDLL(ctypes.util.find_library("m")) if sys.platform != "win32" else ctypes.cdll.msvcrt
    names = [*FUNCTIONS, *(f"{name}f" for name in FUNCTIONS), "memmove", "memcpy", "memset"]
    functions = {name: getattr(mathematics, name, None) for name in names}
    return {name: int(ctypes.cast(function, ctypes.c_void_p).value or 0) for name, function in functions.items() if function is not None}
