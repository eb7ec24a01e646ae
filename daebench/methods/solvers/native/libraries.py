"""The shared libraries of SUNDIALS in the wheel of scikit-sundae: found, checked, and their functions declared."""

import ctypes
import re
from collections.abc import Mapping
from functools import cache
from importlib import metadata
from typing import Any

DISTRIBUTION = "scikit-sundae"

VERSIONS = ((7, 0), (8, 0))
"""From, below: the versions of SUNDIALS whose functions are those declared here."""

KINDS: Mapping[str, Any] = {
    "p": ctypes.c_void_p,
    "d": ctypes.c_double,
    "i": ctypes.c_int,
    "l": ctypes.c_long,
    "n": ctypes.c_int64,
    "s": ctypes.c_char_p,
    "v": None,
}
"""Types of C. "n" is sunindextype, of 32 or 64 bits: as an argument, in a register of 64 bits, it is right for both."""

BOTH = {
    "Init": "ippdpp",
    "SVtolerances": "ipdp",
    "SetLinearSolver": "ippp",
    "SetJacFn": "ipp",
    "SetUserData": "ipp",
    "SetMaxNumSteps": "ipl",
    "SetStopTime": "ipd",
    "Free": "vp",
    "GetDky": "ipdip",
    "GetLastOrder": "ipp",
    "GetLastStep": "ipp",
    "GetCurrentStep": "ipp",
    "GetNumNonlinSolvIters": "ipp",
    "GetNumErrTestFails": "ipp",
    "GetNumNonlinSolvConvFails": "ipp",
    "GetErrWeights": "ipp",
    "GetEstLocalErrors": "ipp",
}
"""What IDA and CVODE both have, under their own prefix."""

FUNCTIONS: Mapping[str, Mapping[str, str]] = {
    "core": {
        "SUNDIALSGetVersionNumber": "ipppsi",
        "SUNContext_Create": "iip",
        "SUNContext_Free": "ip",
        "SUNContext_ClearErrHandlers": "ip",
        "N_VGetArrayPointer": "pp",
        "N_VConst": "vdp",
        "N_VDestroy": "vp",
        "SUNMatDestroy": "vp",
        "SUNLinSolFree": "ip",
    },
    "nvecserial": {"N_VMake_Serial": "pnpp"},
    "sunmatrixdense": {"SUNDenseMatrix": "pnnp", "SUNDenseMatrix_Data": "pp"},
    "sunmatrixband": {
        "SUNBandMatrix": "pnnnp",
        "SUNBandMatrix_Data": "pp",
        "SUNBandMatrix_LDim": "ip",
        "SUNBandMatrix_StoredUpperBandwidth": "ip",
    },
    "sunlinsoldense": {"SUNLinSol_Dense": "pppp"},
    "sunlinsolband": {"SUNLinSol_Band": "pppp"},
    "ida": {f"IDA{name}": kinds for name, kinds in BOTH.items()}
    | {"IDACreate": "pp", "IDAReInit": "ipdpp", "IDASolve": "ipdpppi"}
    | {"IDASetId": "ipp", "IDASetSuppressAlg": "ipi", "IDASetMaxErrTestFails": "ipi"},
    "cvode": {f"CVode{name}": kinds for name, kinds in BOTH.items()}
    | {"CVodeCreate": "pip", "CVodeInit": "ippdp", "CVode": "ipdppi"}
    | {"CVodeSetProjFn": "ipp", "CVodeSetProjErrEst": "ipi", "CVodeSetProjFrequency": "ipl"},
}
"""Functions by library: the kind of the result, then those of the arguments, see :data:`KINDS`."""


class Unavailable(Exception):
    """The shared libraries are not there, or are not those that are declared here; the text says which, and why."""


def paths() -> dict[str, str]:
    """Return the paths of libraries of SUNDIALS in the wheel: libsundials_ida-0f.so.7.9.0, libsundials_ida.7.dylib, sundials_ida-0f.dll."""
    pattern = re.compile(r"(?:lib)?sundials_([a-z]+)(?:-[0-9a-f]+)?(?:\.[\d.]+)?\.(?:so(?:\.[\d.]+)?|dylib|dll)")
    try:
        files = metadata.files(DISTRIBUTION) or []
    except metadata.PackageNotFoundError as error:
        raise Unavailable(f"{DISTRIBUTION} is not installed") from error
    matches = ((pattern.fullmatch(file.name), file) for file in files)
    return {match[1]: str(file.locate()) for match, file in matches if match}


@cache
def functions() -> Mapping[str, Any]:
    """Return all declared functions by name."""
    libraries, declared = paths(), {}
    if missing := [name for name in FUNCTIONS if name not in libraries]:
        raise Unavailable(f"{DISTRIBUTION} has no shared library of SUNDIALS for {', '.join(missing)}")
    for name, table in FUNCTIONS.items():  # core first: on Windows the others find it loaded
        try:
            library = ctypes.CDLL(libraries[name])
            for symbol, kinds in table.items():
                function = declared[symbol] = getattr(library, symbol)
                function.restype, *function.argtypes = [KINDS[kind] for kind in kinds]
        except (OSError, AttributeError) as error:
            raise Unavailable(f"{libraries[name]} cannot be used ({error})") from error
        if name == "core":
            _require_version(declared["SUNDIALSGetVersionNumber"])
    return declared


def address(name: str) -> int:
    """Return the address of a declared function."""
    return int(ctypes.cast(functions()[name], ctypes.c_void_p).value or 0)


def _require_version(ask: Any) -> None:
    numbers, label = (ctypes.c_int * 3)(), ctypes.create_string_buffer(32)
    ask(*(ctypes.addressof(numbers) + 4 * i for i in range(3)), label, 32)
    if not VERSIONS[0] <= tuple(numbers[:2]) < VERSIONS[1]:
        raise Unavailable(
            f"SUNDIALS {'.'.join(map(str, numbers))} is not between {'.'.join(map(str, VERSIONS[0]))} and {'.'.join(map(str, VERSIONS[1]))}"
        )
