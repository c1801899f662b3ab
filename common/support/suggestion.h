// Lookup of known words, with suggestions.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/span.h"

namespace pictura {

/// Returns the known word at the smallest edit distance, regardless of case. Empty if over a third of the letters
/// differ.
std::string nearest_word(std::string_view word, const std::vector<std::string>& known);

/// Returns "; did you mean 'NEAREST'?", or an empty text.
std::string suggestion(std::string_view word, const std::vector<std::string>& known);

/// Returns the index of a word. Throws UsageError "WHAT: expected a, b, got 'c'" for an unknown word.
std::size_t index_of_word(std::string_view what, std::string_view word, Span<const char* const> known);

}  // namespace pictura
