#include "pictura/common/support/suggestion.h"

#include <algorithm>
#include <cctype>

#include <fmt/ranges.h>

#include "pictura/common/error.h"

namespace pictura {

namespace {

std::string lower(std::string_view word) {
  std::string result(word);
  std::transform(result.begin(), result.end(), result.begin(), [](unsigned char c) { return std::tolower(c); });
  return result;
}

// Damerau-Levenshtein distance, in the variant that changes no letter twice (optimal string alignment).
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before_last(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before_last.swap(last);
    last.swap(row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before_last[j - 2] + 1);
      }
    }
  }
  return row[b.size()];
}

}  // namespace

std::string nearest_word(std::string_view word, const std::vector<std::string>& known) {
  constexpr std::size_t kMaxLetters = 100;  // maximum length of a word; the time grows with its square
  if (word.empty() || word.size() > kMaxLetters) return "";
  std::string nearest;
  std::size_t minimum = word.size();
  for (const std::string& candidate : known) {
    const std::size_t letters = distance(lower(word), lower(candidate));
    if (3 * letters <= std::max(word.size(), candidate.size()) && letters < minimum) {
      nearest = candidate;
      minimum = letters;
    }
  }
  return nearest;
}

std::string suggestion(std::string_view word, const std::vector<std::string>& known) {
  const std::string nearest = nearest_word(word, known);
  return nearest.empty() ? "" : fmt::format("; did you mean '{}'?", nearest);
}

std::size_t index_of_word(std::string_view what, std::string_view word, Span<const char* const> known) {
  const auto* const found = std::find(known.begin(), known.end(), word);
  if (found == known.end()) fail_usage("{}: expected {}, got '{}'", what, fmt::join(known, ", "), word);
  return static_cast<std::size_t>(found - known.begin());
}

}  // namespace pictura
