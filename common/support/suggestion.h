// Lookup of known words: the index of a word, and a "did you mean" suggestion for an unknown word.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/span.h"

namespace pictura {

/// Returns the known word with the fewest inserted, omitted, replaced or swapped letters, regardless of case. Empty
/// when more than a third of the word's letters would have to change.
std::string nearest_word(std::string_view word, const std::vector<std::string>& known);

/// Returns "; did you mean 'NEAREST'?", or an empty text if no known word is near.
std::string suggestion(std::string_view word, const std::vector<std::string>& known);

/// Returns the index of a word in `known`. Throws UsageError listing the known words: "WHAT: expected a, b, got 'c'".
std::size_t index_of_word(std::string_view what, std::string_view word, Span<const char* const> known);

}  // namespace pictura
