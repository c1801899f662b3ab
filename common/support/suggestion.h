// Words that are known: where one stands, and "did you mean", the one that is nearest to one that nobody knows.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/span.h"

namespace pictura {

/// The known word that takes the fewest letters inserted, left out, replaced or swapped, regardless of case; empty when
/// none is near: more than a third of its letters would have to change.
std::string nearest_word(std::string_view word, const std::vector<std::string>& known);

/// "; did you mean 'NEAREST'?", or nothing where none is near.
std::string suggestion(std::string_view word, const std::vector<std::string>& known);

/// The index of a word among those that are known. Throws UsageError listing them: "WHAT: expected a, b, got 'c'".
std::size_t index_of_word(std::string_view what, std::string_view word, Span<const char* const> known);

}  // namespace pictura
