"""Arguments of Simulator.observe(): queried slots, hidden boxes, and inserted boxes."""

import numpy as np
from pictura._pictura import INSERTED_DTYPE, QUERY_DTYPE, Error


def make_queries(slots, *, hidden=None, inserted=None, leaves_gaps=False):
    """Returns queries for Simulator.observe(), on the CPU, as the tuple (queries, hidden, inserted) of NumPy arrays.

    Args:
        slots: Slots whose observations are requested, int [n].
        hidden: Boxes that each query hides: n lists of indices into the scene's boxes, or a tuple (indices, begin), in
            which query i hides indices[begin[i]:begin[i + 1]].
        inserted: Boxes that each query inserts: n lists of INSERTED_DTYPE, or a tuple (boxes, begin) like `hidden`.
        leaves_gaps: bool, or bool [n]: whether rows of zeros replace hidden boxes.

    Returns:
        tuple: QUERY_DTYPE [n], int32 [number of hidden boxes], INSERTED_DTYPE [number of inserted boxes].

    Raises:
        pictura.Error: The length of a list is wrong; the message names the argument.

    Examples:
        >>> simulator = pictura.Simulator([pictura.Map.load("procedural:3")], [(0, 8)])
        >>> answers = simulator.observe(*pictura.make_queries([0, 0], hidden=[[], [1]]))
        >>> answers["partners"].shape
        (2, 16, 8)
    """
    queries = np.zeros(len(slots), QUERY_DTYPE)
    queries["slot"] = slots
    queries["leaves_gaps"] = leaves_gaps
    hidden, queries["hidden_begin"], queries["hidden_end"] = _flat(hidden, len(slots), np.dtype(np.int32), "hidden")
    inserted, queries["inserted_begin"], queries["inserted_end"] = _flat(inserted, len(slots), INSERTED_DTYPE, "inserted")
    return queries, hidden, inserted


def _flat(lists, count: int, dtype: np.dtype, name: str):
    """Concatenates lists. Returns the result, and the begin and end of each list."""
    if lists is None:
        return np.zeros(0, dtype), 0, 0
    if isinstance(lists, tuple):
        if len(lists) != 2 or np.shape(lists[1]) != (count + 1,):
            raise Error(f"make_queries: {name}: expected (list, begin) with begin [{count + 1}], or {count} lists")
        return np.ascontiguousarray(lists[0], dtype), lists[1][:-1], lists[1][1:]
    if len(lists) != count:
        raise Error(f"make_queries: {name}: expected {count} lists, got {len(lists)}")
    begin = np.cumsum([0, *(len(one) for one in lists)])
    filled = [np.asarray(one, dtype) for one in lists if len(one)]
    return np.concatenate(filled) if filled else np.zeros(0, dtype), begin[:-1], begin[1:]
