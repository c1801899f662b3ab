// "Did you mean": the known word that is nearest to one that nobody knows.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace pictura {

/// The known word that takes the fewest letters inserted, left out, replaced or swapped, regardless of case; empty when
/// none is near: more than a third of its letters would have to change.
std::string nearest_word(std::string_view word, const std::vector<std::string>& known);

/// "; did you mean 'NEAREST'?", or nothing where none is near.
std::string suggestion(std::string_view word, const std::vector<std::string>& known);

}  // namespace pictura
