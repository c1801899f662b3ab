#include "pictura/common/support/toml_fields.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include <fmt/ranges.h>

#include "pictura/common/error.h"
#include "pictura/common/support/suggestion.h"

namespace pictura {

toml::table parse_toml(const std::string& text, const std::string& source) {
  try {
    return toml::parse(text, source);
  } catch (const toml::parse_error& error) {
    fail("{}:{}: {}", source, error.source().begin.line, error.description());
  }
}

std::optional<int64_t> whole_number(const toml::node& node) {
  if (node.is_integer()) return node.as_integer()->get();
  if (!node.is_floating_point()) return std::nullopt;
  const double number = node.as_floating_point()->get();
  constexpr double kExact = 9007199254740992;  // above this, a double no longer represents every integer
  if (!(std::abs(number) <= kExact) || number != std::floor(number)) return std::nullopt;
  return static_cast<int64_t>(number);
}

std::string format_value(const toml::node& node) {
  std::ostringstream value;
  node.visit([&](const auto& its) { value << its; });
  // Tables have many lines, and texts with line breaks are printed in triple quotes.
  std::string text = node.is_table() ? "a table" : value.str();
  if (node.is_string()) text = fmt::format("'{}'", *node.value<std::string>());
  constexpr std::size_t kMaxShown = 60;
  if (text.size() > kMaxShown) text = text.substr(0, kMaxShown) + "...";
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

TomlFields::TomlFields(const toml::table& table, std::string source, std::string name)
    : table_(&table), source_(std::move(source)), name_(std::move(name)) {}

const toml::node* TomlFields::find(std::string_view key) {
  if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.emplace_back(key);
  return table_->get(key);
}

const toml::node& TomlFields::require(std::string_view key) {
  const toml::node* node = find(key);
  if (!node) throw_error(key, "is missing");
  return *node;
}

void TomlFields::throw_error(std::string_view key, std::string_view message) const {
  const toml::node* node = table_->get(key);
  const auto line = (node ? node : table_)->source().begin.line;
  fail("{}:{}: {}{}{}: {}", source_, line, name_, name_.empty() ? "" : ": ", key, message);
}

void TomlFields::throw_error(std::string_view key, const toml::node& node, std::string_view expected) const {
  fail("{}:{}: {}{}{}: expected {}, got {}", source_, node.source().begin.line, name_, name_.empty() ? "" : ": ", key,
       expected, format_value(node));
}

float TomlFields::number_of(std::string_view key, const toml::node& node, Range range) const {
  const double value = node.is_number() ? *node.value<double>() : 0;
  if (!node.is_number() || !(value >= range.low && value <= range.high)) {
    throw_error(key, node, fmt::format("a number in [{}, {}]", range.low, range.high));
  }
  return static_cast<float>(value);
}

float TomlFields::number(std::string_view key, Range range) { return number_of(key, require(key), range); }

float TomlFields::number(std::string_view key, Range range, float fallback) {
  const toml::node* node = find(key);
  return node ? number_of(key, *node, range) : fallback;
}

int TomlFields::integer_of(std::string_view key, const toml::node& node, Range range) const {
  const std::optional<int64_t> value = whole_number(node);
  if (!value || static_cast<double>(*value) < range.low || static_cast<double>(*value) > range.high) {
    throw_error(key, node, fmt::format("an integer in [{}, {}]", range.low, range.high));
  }
  return static_cast<int>(*value);
}

int TomlFields::integer(std::string_view key, Range range) { return integer_of(key, require(key), range); }

int TomlFields::integer(std::string_view key, Range range, int fallback) {
  const toml::node* node = find(key);
  return node ? integer_of(key, *node, range) : fallback;
}

bool TomlFields::flag(std::string_view key, bool fallback) {
  const toml::node* node = find(key);
  if (!node) return fallback;
  if (!node->is_boolean()) throw_error(key, *node, "true or false");
  return node->as_boolean()->get();
}

std::string TomlFields::text(std::string_view key, const std::string& fallback) {
  const toml::node* node = find(key);
  if (!node) return fallback;
  if (!node->is_string()) throw_error(key, *node, "a text");
  return node->as_string()->get();
}

std::string TomlFields::file_name(std::string_view key, const std::string& fallback) {
  const std::string name = text(key, fallback);
  constexpr std::string_view kAllowed = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_";
  if (name.empty() || name.size() > 64 || name.find_first_not_of(kAllowed) != std::string::npos) {
    throw_error(key, fmt::format("expected 1 to 64 letters, digits, '-' and '_', got '{}'", name));
  }
  return name;
}

int TomlFields::choice(std::string_view key, Span<const std::string_view> names, int fallback) {
  if (!has(key) && fallback >= 0) return find(key), fallback;
  const toml::node& node = require(key);
  const auto* found = node.is_string() ? std::find(names.begin(), names.end(), node.as_string()->get()) : names.end();
  if (found == names.end()) {
    throw_error(key, node, fmt::format("one of {}", fmt::join(names.begin(), names.end(), ", ")));
  }
  return static_cast<int>(found - names.begin());
}

const toml::array& TomlFields::list_of(std::string_view key, const toml::node& node) const {
  if (!node.is_array()) throw_error(key, node, "a list");
  return *node.as_array();
}

std::vector<float> TomlFields::numbers(std::string_view key, Range range, std::size_t size) {
  const toml::node& node = require(key);
  const toml::array& list = list_of(key, node);
  if (list.size() != size) throw_error(key, node, fmt::format("{} numbers", size));
  std::vector<float> values;
  for (const toml::node& element : list) values.push_back(number_of(key, element, range));
  return values;
}

std::vector<int> TomlFields::integers(std::string_view key, Range range, std::vector<int> fallback) {
  const toml::node* node = find(key);
  if (!node) return fallback;
  std::vector<int> values;
  for (const toml::node& element : list_of(key, *node)) values.push_back(integer_of(key, element, range));
  return values;
}

std::vector<Vec3> TomlFields::points(std::string_view key, Range range, std::size_t minimum) {
  const toml::node& node = require(key);
  std::vector<Vec3> points;
  for (const toml::node& element : list_of(key, node)) {
    const toml::array& point = list_of(key, element);
    if (point.size() != 2 && point.size() != 3) throw_error(key, element, "[x, y] or [x, y, z]");
    points.push_back({number_of(key, point[0], range), number_of(key, point[1], range),
                      point.size() == 3 ? number_of(key, point[2], range) : 0.0f});
  }
  if (points.size() < minimum)
    throw_error(key, fmt::format("expected {} points or more, got {}", minimum, points.size()));
  return points;
}

std::vector<TomlFields> TomlFields::tables(std::string_view key) {
  std::vector<TomlFields> tables;
  const toml::node* node = find(key);
  if (!node) return tables;
  if (node->is_table()) throw_error(key, fmt::format("expected [[{}]] tables, got a table [{}]", key, key));
  for (const toml::node& element : list_of(key, *node)) {
    if (!element.is_table()) throw_error(key, element, "a table");
    tables.emplace_back(*element.as_table(), source_, fmt::format("{} {}", key, tables.size()));
  }
  return tables;
}

void TomlFields::reject_unknown_keys() const {
  for (const auto& [key, node] : *table_) {
    if (std::find(known_.begin(), known_.end(), key.str()) == known_.end()) {
      fail("{}:{}: {}{}unknown key '{}'{}; known keys: {}", source_, node.source().begin.line, name_,
           name_.empty() ? "" : ": ", key.str(), suggestion(key.str(), known_), fmt::join(known_, ", "));
    }
  }
}

}  // namespace pictura
