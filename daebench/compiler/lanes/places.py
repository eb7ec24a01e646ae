"""Slots in memory for lanes in nested tuples: results that a few runs return early are stored there, and read at the end."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.datamodel.models import PrimitiveModel
from numba.extending import intrinsic, register_model

from daebench.compiler.lanes.number import SCALAR, Lanes, element


class Slot(types.Type):  # type: ignore[misc]
    """The type of a slot in memory for nested tuples of a type."""

    def __init__(self, of: Any) -> None:
        self.of = of
        super().__init__(name=f"Slot({of})")


@register_model(Slot)
class SlotModel(PrimitiveModel):  # type: ignore[misc]
    """A slot is its address."""

    def __init__(self, dmm: Any, fe_type: Slot) -> None:
        super().__init__(dmm, fe_type, dmm.lookup(fe_type.of).get_value_type().as_pointer())


def _seen(builder: Any, place: Any) -> None:
    """Make LLVM assume that a slot is read and written here, so that it does not hold the content in registers."""
    function = ir.FunctionType(ir.VoidType(), [place.type])
    builder.call(ir.InlineAsm(function, "", "r,~{memory}", side_effect=True), [place])


@intrinsic(prefer_literal=True)  # type: ignore[untyped-decorator]
def held(typingctx: Any, like: Any, width: Any) -> Any:
    """Return a slot in memory for nested tuples of the form of ``like``, with lanes in place of numbers."""

    def form(of: Any) -> Any:
        if isinstance(of, types.BaseTuple):
            return types.Tuple(tuple(map(form, of)))
        return Lanes(element(of), width.literal_value) if isinstance(of, (Lanes, *SCALAR)) else of

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        with builder.goto_entry_block():
            place = builder.alloca(context.get_value_type(sig.return_type.of))
        _seen(builder, place)
        return place

    return Slot(form(like))(like, width), lowered


@intrinsic  # type: ignore[untyped-decorator]
def note(typingctx: Any, slot: Any, first: Any, x: Any) -> Any:
    """Write nested tuples into a slot, in the lanes where ``first`` is true."""

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        def written(of: Any, kind: Any, value: Any, path: tuple[int, ...]) -> None:
            if isinstance(of, types.BaseTuple):
                for i, (part, part_kind) in enumerate(zip(of, kind, strict=True)):
                    written(part, part_kind, builder.extract_value(value, i), (*path, i))
            elif isinstance(of, Lanes):
                place = cgutils.gep_inbounds(builder, args[0], 0, *path)
                new = context.cast(builder, value, kind, of)
                builder.store(builder.select(mask, new, builder.load(place)), place)

        mask = args[1] if isinstance(first, Lanes) else context.cast(builder, args[1], first, types.boolean)
        written(slot.of, x, args[2], ())
        _seen(builder, args[0])
        return context.get_dummy_value()

    return types.none(slot, first, x), lowered


@intrinsic  # type: ignore[untyped-decorator]
def recall(typingctx: Any, slot: Any) -> Any:
    """Return the nested tuples in a slot."""
    return slot.of(slot), lambda context, builder, sig, args: builder.load(args[0])
