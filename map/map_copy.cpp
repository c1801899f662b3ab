#include "pictura/map/map_copy.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "pictura/common/error.h"
#include "pictura/common/rng.h"
#include "pictura/common/support/hash.h"
#include "pictura/common/support/numbers.h"
#include "pictura/map/procedural/town_options.h"

namespace pictura {

namespace {

bool is_digits(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// Appends the names of the towns of a range FAMILY:FIRST-LAST[REST]. Returns false for other names.
bool append_range(const std::string& name, std::vector<std::string>* names_out) {
  const TownFamily* family = town_family_of(name);
  if (!family || name == family->name) return false;
  const std::size_t begin = name.find(':') + 1;
  const std::size_t end = std::min(name.find_first_of(":#", begin), name.size());
  const std::string seeds = name.substr(begin, end - begin);
  const std::size_t dash = seeds.find('-');
  if (dash == std::string::npos) return false;
  const std::optional<uint64_t> first = parse_unsigned(seeds.substr(0, dash)),
                                last = parse_unsigned(seeds.substr(dash + 1));
  if (!first || !last || *last < *first || *last - *first >= uint64_t{kMaxTownRange}) {
    fail_usage("map '{}': expected {}:FIRST-LAST with ascending seeds of at most {} towns, got '{}'", name,
               family->name, kMaxTownRange, seeds);
  }
  for (uint64_t i = 0; i <= *last - *first; ++i) {
    names_out->push_back(fmt::format("{}:{}{}", family->name, *first + i, name.substr(end)));
  }
  return true;
}

}  // namespace

MapCopy parse_map_copy(std::string_view name) {
  const std::size_t mark = name.rfind('#');
  if (mark == std::string_view::npos || !is_digits(name.substr(mark + 1))) return {name, 0};
  const std::optional<uint64_t> copy = parse_unsigned(name.substr(mark + 1));
  if (!copy || *copy < 1 || *copy > uint64_t{kMaxMapCopies}) {
    fail_usage("map '{}': expected a copy of 1 to {} after #, got '{}'", name, kMaxMapCopies, name.substr(mark + 1));
  }
  return {name.substr(0, mark), static_cast<int>(*copy)};
}

std::string map_copy_name(std::string_view map, int copy) { return fmt::format("{}#{}", map, copy); }

PlanMap draw_map_copy(std::string_view map_name, int copy) {
  RandomStream random(
      {.seed = hash_of(map_name), .world = static_cast<uint32_t>(copy), .purpose = Purpose::map_copies});
  const double scale = random.uniform(kMinCopyScale, kMaxCopyScale);
  const double shear = random.uniform(-kMaxCopyShear, kMaxCopyShear);
  const double rotation = random.uniform(-kPi, kPi);
  const double c = scale * std::cos(rotation), s = scale * std::sin(rotation);
  return {c, shear * c - s, s, shear * s + c};
}

std::vector<std::string> expand_map_names(const std::vector<std::string>& names) {
  std::vector<std::string> expanded;
  for (const std::string& name : names) {
    if (!append_range(name, &expanded)) expanded.push_back(name);
  }
  return expanded;
}

std::vector<std::string> with_map_copies(std::vector<std::string> maps, int copies) {
  const std::vector<std::string> originals = maps;
  for (int copy = 1; copy <= copies; ++copy) {
    for (const std::string& map : originals) maps.push_back(map_copy_name(map, copy));
  }
  return maps;
}

}  // namespace pictura
