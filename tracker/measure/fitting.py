"""One answer that no document can carry is that answer's outcome, not the end of the run it belongs to.

An engine may answer with a status that does not exist, with a count of four hundred digits, with text that is none.
"""

from __future__ import annotations

import msgspec

from spook_tracker.tracker.document.json_form import NAN, Writable, builtins, convert, decode, encode
from spook_tracker.tracker.document.outside import clean_text
from spook_tracker.tracker.document.run_document import FigureData, RunDocument, Sample

LARGEST = 2**63 - 1  # whole number that is stored
SENTENCE = 300  # characters of what does not fit


def fitted(sample: Sample) -> Sample:
    """The sample; or one that says why it cannot be written down."""
    fault = unfit(sample)
    return sample if not fault else _crashed(sample.series, fault)


def fitted_figure(figure: FigureData) -> FigureData:
    """The figure; or an empty one that says why it cannot be written down."""
    fault = unfit(figure)
    return (
        msgspec.structs.replace(figure, curves=(), note=f"could not be drawn: {fault}") if fault else figure
    )


def _crashed(series: str, fault: str) -> Sample:
    return Sample(
        series=series, value=NAN, outcome="crashed", passed=False, set_point_held=False,
        failure=f"the answer cannot be written down: {fault}",
    )  # fmt: skip


def unfit(part: msgspec.Struct) -> str:
    """Why a part of a document cannot be written and read again; empty if it can."""
    try:
        _refuse_long(decode(encode(part), type(part)))
    except UnicodeError:
        return ""  # text is made readable where the document is written
    except (msgspec.MsgspecError, OverflowError, TypeError, ValueError, RecursionError) as error:
        return " ".join(str(error).split())[:SENTENCE]
    return ""


def _refuse_long(part: msgspec.Struct) -> None:
    for count in getattr(part, "counters", {}).values():
        if abs(count) > LARGEST:
            raise ValueError(f"a whole number of {len(str(abs(count)))} digits; 64 bits hold 19")


def written(document: RunDocument) -> bytes:
    """The document as JSON; text that is not Unicode is made such."""
    try:
        return encode(document)
    except UnicodeError:
        return encode(convert(_readable(builtins(document)), RunDocument))


def _readable(part: Writable) -> Writable:
    if isinstance(part, str):
        return clean_text(part)
    if isinstance(part, dict):
        return {clean_text(name): _readable(inner) for name, inner in part.items()}
    return [_readable(inner) for inner in part] if isinstance(part, list | tuple) else part
