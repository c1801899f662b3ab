// Strict reader of TOML: keys that code does not read are errors. Not installed, so that users do not need toml++.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toml++/toml.h>

#include "pictura/common/camera.h"
#include "pictura/common/error_types.h"
#include "pictura/common/span.h"

namespace pictura {

/// Throws Error naming source and line.
toml::table parse_toml(const std::string& text, const std::string& source);

/// Returns an integer in any notation, such as 1e3. Nothing for other values.
std::optional<int64_t> whole_number(const toml::node& node);

/// Formats a value for messages, in one short line.
std::string format_value(const toml::node& node);

/// Reader of one table, which must outlive the object. Throws Error for wrong types and ranges, and for missing keys
/// without a fallback.
class TomlFields {
 public:
  struct Range {
    double low, high;  // inclusive
  };

  /// `name` is the table's name in messages.
  TomlFields(const toml::table& table, std::string source, std::string name = "");

  void rename(std::string name) { name_ = std::move(name); }
  bool has(std::string_view key) { return find(key) != nullptr; }
  float number(std::string_view key, Range range);
  float number(std::string_view key, Range range, float fallback);
  int integer(std::string_view key, Range range);
  int integer(std::string_view key, Range range, int fallback);
  bool flag(std::string_view key, bool fallback);
  std::string text(std::string_view key, const std::string& fallback);
  /// Reads at most 64 letters, digits, '-' and '_'.
  std::string file_name(std::string_view key, const std::string& fallback);
  /// Reads a text and returns its index in `names`. A fallback of -1 makes the key mandatory.
  int choice(std::string_view key, Span<const std::string_view> names, int fallback = -1);
  std::vector<float> numbers(std::string_view key, Range range, std::size_t size);
  std::vector<int> integers(std::string_view key, Range range, std::vector<int> fallback);
  /// Reads at least `minimum` points [x, y] (z is 0) or [x, y, z].
  std::vector<Vec3> points(std::string_view key, Range range, std::size_t minimum);
  std::vector<TomlFields> tables(std::string_view key);

  /// Throws Error for the first key that was not read.
  void reject_unknown_keys() const;
  /// Throws Error "file:line: table: key: message".
  [[noreturn]] void throw_error(std::string_view key, std::string_view message) const;

 private:
  const toml::node* find(std::string_view key);  // also records the key
  const toml::node& require(std::string_view key);
  int integer_of(std::string_view key, const toml::node& node, Range range) const;
  float number_of(std::string_view key, const toml::node& node, Range range) const;
  const toml::array& list_of(std::string_view key, const toml::node& node) const;
  [[noreturn]] void throw_error(std::string_view key, const toml::node& node, std::string_view expected) const;

  const toml::table* table_;
  std::string source_, name_;
  std::vector<std::string> known_;
};

/// Reads the rig of the [[camera]] tables, which may be absent.
Rig read_cameras(TomlFields* fields_inout);

}  // namespace pictura
